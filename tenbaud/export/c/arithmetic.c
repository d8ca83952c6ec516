#include "arithmetic.h"

bool arithmetic_fault = false;

/* The root of a whole number of 106 bits or fewer, bit by bit; `*rest` is 0 where it is exact. */
static uint64_t root_of(uint64_t significand, bool *is_exact) {
    uint64_t root = 0, rest = 0;
    /* The number is `significand` times 2^54: two of its bits a turn, 54 turns. */
    for (int turn = 0; turn < 54; turn++) {
        const int shift = 52 - 2 * turn;
        const uint64_t bits = shift >= 0 ? (significand >> shift) & 3u : 0u;
        rest = rest << 2 | bits;
        const uint64_t trial = root << 2 | 1u;
        root <<= 1;
        if (rest >= trial) {
            rest -= trial;
            root |= 1u;
        }
    }
    *is_exact = rest == 0;
    return root;
}

double arithmetic_sqrt(double x) {
    uint64_t bits;
    if (x == 0.0 || x == (double)INFINITY) return x;
    if (!(x > 0.0)) {
        arithmetic_fault = true;
        return 0.0;
    }
    int exponent = 0;
    if (x < DBL_MIN) { /* subnormal */
        x *= 0x1p54;
        exponent = -54;
    }
    memcpy(&bits, &x, sizeof bits);
    exponent += (int)(bits >> 52) - 1075;
    uint64_t significand = (bits & 0xFFFFFFFFFFFFFu) | 0x10000000000000u;
    if (exponent & 1) {
        significand <<= 1;
        exponent -= 1;
    }
    /* x = significand * 2^exponent; root = sqrt(significand * 2^54), of 54 bits: one more than a double's. */
    bool is_exact;
    const uint64_t root = root_of(significand, &is_exact);
    uint64_t rounded = root >> 1;
    if ((root & 1u) && (!is_exact || (rounded & 1u))) rounded++;
    /* rounded * 2^(exponent / 2 - 26) */
    bits = (uint64_t)(exponent / 2 - 26 + 1075) << 52;
    bits += rounded - 0x10000000000000u;
    memcpy(&x, &bits, sizeof x);
    return x;
}
