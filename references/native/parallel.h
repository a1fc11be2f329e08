// Work on many things at once, by threads that take blocks of them in turn.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <system_error>
#include <thread>
#include <vector>

namespace notabug {

// Calls work(begin, end) for blocks of at most `block` of the `count` things. What `work` does for one must not depend on
// the others: then the result is the same with any number of threads; 0 takes as many as there are processors.
template <class Work>
void parallel(std::int64_t count, std::int64_t block, int threads, Work&& work) {
    if (threads <= 0) threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    const std::int64_t blocks = (count + block - 1) / block;
    threads = static_cast<int>(std::min<std::int64_t>(threads, blocks));
    std::atomic<std::int64_t> next{0};
    const auto run = [&] {
        for (std::int64_t k = next++; k < blocks; k = next++) work(k * block, std::min(count, (k + 1) * block));
    };
    std::vector<std::thread> others;
    for (int i = 1; i < threads; ++i) {
        try {
            others.emplace_back(run);
        } catch (const std::system_error&) {  // no more threads to be had: the others do it
            break;
        }
    }
    run();
    for (std::thread& each : others) each.join();
}

}  // namespace notabug
