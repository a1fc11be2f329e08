// By how much the mean of a pixel's samples may be off the mean of its footprint, from the samples themselves.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace notabug {

constexpr int most_remembered = 8;  // samples along a side of a grid
constexpr int parts = 4;            // of a lattice, each a lattice of its own
// Of the root mean square error of the parts: were they independent it would be a half, and lattices do better. Measured on
// edges of objects, shadows and textures, of 64 and 256 samples against 4,096: 99 of 100 are below .35, the largest is .93.
constexpr double whole_of_parts = 1.0;

// Of a regular grid: what bends between three samples in line. A step of height c that lies anywhere between two of n
// samples moves their mean by at most c / 2n; it shows in the second difference, where an even slope, whose mean a grid
// knows, does not. Each row and each column counts with its largest.
//
// Of a lattice: how far the means of its parts, every fourth sample, scatter (L'Ecuyer and Lemieux 2000, "Variance
// Reduction via Lattice Rules": a rule's error from randomised copies of it). The whole is more exact than they tell.
class Estimate {
  public:
    Estimate(std::int64_t grid, std::int64_t samples) : grid_(grid), samples_(samples) {}

    void add(std::int64_t s, const double* value) {
        if (grid_ > 1 && grid_ <= most_remembered) std::copy(value, value + 3, value_[s]);
        for (int k = 0; grid_ < 0 && k < 3; ++k) sum_[s % parts][k] += value[k];
    }

    double error(int channel, double mean) const {
        if (grid_ < 0) return scatter(channel, mean);
        return grid_ > 2 && grid_ <= most_remembered ? (bends(channel, 1, grid_) + bends(channel, grid_, 1)) : 0.0;
    }

  private:
    double scatter(int channel, double mean) const {
        double squares = 0;
        for (const auto& sum : sum_) {
            const double off = sum[channel] * parts / static_cast<double>(samples_) - mean;
            squares += off * off;
        }
        return whole_of_parts * std::sqrt(squares / parts);
    }

    // The mean over all lines of what the largest second difference of each allows; samples of a line are `step` apart.
    double bends(int channel, std::int64_t step, std::int64_t line) const {
        double sum = 0;
        for (std::int64_t j = 0; j < grid_; ++j) {
            double most = 0;
            for (std::int64_t i = 1; i + 1 < grid_; ++i) {
                const double(*at)[3] = value_ + j * line + i * step;
                most = std::max(most, std::abs(at[-step][channel] - 2 * at[0][channel] + at[step][channel]));
            }
            sum += most;
        }
        const auto n = static_cast<double>(grid_);
        return sum / (2 * n * n);
    }

    std::int64_t grid_, samples_;
    double value_[most_remembered * most_remembered][3];
    double sum_[parts][3] = {};
};

}  // namespace notabug
