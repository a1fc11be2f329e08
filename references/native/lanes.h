// Several numbers at a time, 16 bytes of them: the vectors of GCC and Clang, for any processor.
#pragma once

#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace notabug {

template <class T>
struct PackOf;
template <>
struct PackOf<float> {
    using type = float __attribute__((vector_size(16)));
    using mask = std::int32_t __attribute__((vector_size(16)));
};
template <>
struct PackOf<double> {
    using type = double __attribute__((vector_size(16)));
    using mask = std::int64_t __attribute__((vector_size(16)));
};

template <class T>
using Pack = typename PackOf<T>::type;  // four float, or two double

using Lanes = Pack<float>;  // one number for each box of a node

template <class T>
inline Pack<T> pack_of(const T* from) {
    Pack<T> made;
    std::memcpy(&made, from, sizeof made);
    return made;
}

template <class P, class T>
inline void keep(P pack, T* into) {
    std::memcpy(into, &pack, sizeof pack);
}

inline Lanes all_lanes(float x) { return Lanes{x, x, x, x}; }

// Of two the larger or the smaller; where one is NaN the second.
template <class P>
inline P larger(P a, P b) {
    return a > b ? a : b;
}
template <class P>
inline P smaller(P a, P b) {
    return a < b ? a : b;
}

// One bit for each lane in which a comparison holds.
inline unsigned bits_of(PackOf<float>::mask holds) {
#if defined(__SSE2__)
    return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(holds)));
#else
    return (holds[0] & 1u) | (holds[1] & 2u) | (holds[2] & 4u) | (holds[3] & 8u);
#endif
}

inline unsigned bits_of(PackOf<double>::mask holds) {
#if defined(__SSE2__)
    return static_cast<unsigned>(_mm_movemask_pd(reinterpret_cast<__m128d>(holds)));
#else
    return static_cast<unsigned>((holds[0] & 1) | (holds[1] & 2));
#endif
}

}  // namespace notabug
