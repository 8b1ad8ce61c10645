/* Numbers that look random and are the same everywhere. Source: Steele, Lea and Flood (2014), SplitMix. */
#ifndef RUMO_RANDOM_H
#define RUMO_RANDOM_H

#include <math.h>
#include <stdint.h>

static uint64_t random_state = 1;

static inline uint64_t random_bits(void) {
    uint64_t z = random_state += UINT64_C(0x9E3779B97F4A7C15);
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

static inline double uniform(double lower, double upper) {
    return lower + (upper - lower) * (double)(random_bits() >> 11) * 0x1p-53;
}

static inline int below(int count) { return (int)(random_bits() % (uint64_t)count); }

/* Of either sign, with an even distribution of the exponent. */
static inline double of_any_size(double smallest, double largest) {
    return (below(2) ? 1.0 : -1.0) * pow(10.0, uniform(log10(smallest), log10(largest)));
}

#endif
