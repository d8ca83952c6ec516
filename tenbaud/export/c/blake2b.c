#include "blake2b.h"

static const uint64_t start[8] = {
    0x6a09e667f3bcc908u, 0xbb67ae8584caa73bu, 0x3c6ef372fe94f82bu, 0xa54ff53a5f1d36f1u,
    0x510e527fade682d1u, 0x9b05688c2b3e6c1fu, 0x1f83d9abfb41bd6bu, 0x5be0cd19137e2179u};

static const uint8_t order[10][16] = {
    {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15},
    {14, 10, 4, 8, 9, 15, 13, 6, 1, 12, 0, 2, 11, 7, 5, 3},
    {11, 8, 12, 0, 5, 2, 15, 13, 10, 14, 3, 6, 7, 1, 9, 4},
    {7, 9, 3, 1, 13, 12, 11, 14, 2, 6, 5, 10, 4, 0, 15, 8},
    {9, 0, 5, 7, 2, 4, 10, 15, 14, 1, 11, 12, 6, 8, 3, 13},
    {2, 12, 6, 10, 0, 11, 8, 3, 4, 13, 7, 5, 15, 14, 1, 9},
    {12, 5, 1, 15, 14, 13, 4, 10, 0, 7, 6, 3, 9, 2, 8, 11},
    {13, 11, 7, 14, 12, 1, 3, 9, 5, 0, 15, 4, 8, 6, 2, 10},
    {6, 15, 14, 9, 11, 3, 0, 8, 12, 2, 13, 7, 1, 4, 10, 5},
    {10, 2, 8, 4, 7, 6, 1, 5, 15, 11, 9, 14, 3, 12, 13, 0}};

static uint64_t turned(uint64_t x, int by) { return x >> by | x << (64 - by); }

static void mix(uint64_t *v, int a, int b, int c, int d, uint64_t x, uint64_t y) {
    v[a] += v[b] + x;
    v[d] = turned(v[d] ^ v[a], 32);
    v[c] += v[d];
    v[b] = turned(v[b] ^ v[c], 24);
    v[a] += v[b] + y;
    v[d] = turned(v[d] ^ v[a], 16);
    v[c] += v[d];
    v[b] = turned(v[b] ^ v[c], 63);
}

static void compress(blake2b_state *state, int is_last) {
    uint64_t v[16], m[16];
    for (int at = 0; at < 16; at++) {
        m[at] = 0;
        for (int byte = 7; byte >= 0; byte--) m[at] = m[at] << 8 | state->block[8 * at + byte];
        v[at] = at < 8 ? state->chain[at] : start[at - 8];
    }
    v[12] ^= state->count;
    if (is_last) v[14] = ~v[14];
    for (int round = 0; round < 12; round++) {
        const uint8_t *s = order[round % 10];
        for (int at = 0; at < 4; at++)
            mix(v, at, at + 4, at + 8, at + 12, m[s[2 * at]], m[s[2 * at + 1]]);
        for (int at = 0; at < 4; at++)
            mix(v, at, (at + 1) % 4 + 4, (at + 2) % 4 + 8, (at + 3) % 4 + 12, m[s[2 * at + 8]], m[s[2 * at + 9]]);
    }
    for (int at = 0; at < 8; at++) state->chain[at] ^= v[at] ^ v[at + 8];
}

void blake2b_begin(blake2b_state *state, uint32_t digest_size) {
    for (int at = 0; at < 8; at++) state->chain[at] = start[at];
    state->chain[0] ^= 0x01010000u ^ digest_size;
    state->count = 0;
    state->filled = 0;
    state->size = digest_size;
}

void blake2b_add(blake2b_state *state, const uint8_t *bytes, uint32_t count) {
    for (uint32_t at = 0; at < count; at++) {
        if (state->filled == 128) {
            state->count += 128;
            compress(state, 0);
            state->filled = 0;
        }
        state->block[state->filled++] = bytes[at];
    }
}

void blake2b_end(blake2b_state *state, uint8_t *digest) {
    state->count += state->filled;
    for (uint32_t at = state->filled; at < 128; at++) state->block[at] = 0;
    compress(state, 1);
    for (uint32_t at = 0; at < state->size; at++) digest[at] = (uint8_t)(state->chain[at / 8] >> 8 * (at % 8));
}

void blake2b(uint8_t *digest, uint32_t digest_size, const uint8_t *bytes, uint32_t count) {
    blake2b_state state;
    blake2b_begin(&state, digest_size);
    blake2b_add(&state, bytes, count);
    blake2b_end(&state, digest);
}
