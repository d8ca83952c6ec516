/* Operations of Python that C does otherwise, and the compiler's duty to do the rest as written.
 *
 * The codec's state must be equal at both ends to the last bit. So every operation has to be rounded
 * once to binary64, in the order of the text: no fused multiply-add, no wider registers, no fast-math.
 * Compile with -ffp-contract=off. The numerics probe of the handshake shows a compiler that disobeys.
 */
#ifndef TENBAUD_ARITHMETIC_H
#define TENBAUD_ARITHMETIC_H

#include <float.h>
#include <math.h> /* INFINITY alone; no function of it is called */
#include <stdbool.h>
#include <stdint.h>
#include <string.h> /* memcpy alone */

#if defined(__FAST_MATH__) || defined(__RECIPROCAL_MATH__) || defined(__ASSOCIATIVE_MATH__) \
    || defined(__NO_SIGNED_ZEROS__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "the codec needs exact arithmetic: compile without -ffast-math and its parts"
#endif
#if FLT_EVAL_METHOD != 0
#error "the codec needs doubles that are rounded to doubles: FLT_EVAL_METHOD must be 0 (x86: -msse2 -mfpmath=sse)"
#endif
#if FLT_RADIX != 2 || DBL_MANT_DIG != 53 || DBL_MAX_EXP != 1024
#error "the codec needs doubles of IEEE 754 binary64"
#endif
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off")
#endif

/* Set where Python would raise an exception, and never reset by the codec. The state is worthless then. */
extern bool arithmetic_fault;

/* The square root, rounded to the nearest double; for a negative number a fault. */
double arithmetic_sqrt(double x);

static inline double arithmetic_divide(double over, double under) {
    if (under == 0.0) {
        arithmetic_fault = true;
        return 0.0;
    }
    return over / under;
}

static inline bool arithmetic_is_finite(double x) { return x - x == 0.0; }

/* The number without its fraction. Numbers beyond 2^30 become 2^30: those of the codec are smaller. */
static inline int32_t arithmetic_whole(double x) {
    const int32_t most = 1 << 30;
    if (!arithmetic_is_finite(x)) {
        arithmetic_fault = true;
        return 0;
    }
    return x >= (double)most ? most : x <= (double)-most ? -most : (int32_t)x;
}

static inline int32_t arithmetic_floor(double x) {
    const int32_t whole = arithmetic_whole(x);
    return x < (double)whole && whole > -(1 << 30) ? whole - 1 : whole;
}

/* By a number above 0. */
static inline int32_t arithmetic_floor_divide(int32_t over, int32_t under) {
    const int32_t quotient = over / under;
    return over % under < 0 ? quotient - 1 : quotient;
}

static inline int32_t arithmetic_remainder(int32_t over, int32_t under) {
    const int32_t rest = over % under;
    return rest < 0 ? rest + under : rest;
}

/* An index within a sequence; a fault, and the first one, for any other. */
static inline int32_t arithmetic_index(int32_t index, int32_t count) {
    if (index < 0 || index >= count) {
        arithmetic_fault = true;
        return 0;
    }
    return index;
}

#endif
