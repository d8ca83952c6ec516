/* The hash BLAKE2b (RFC 7693), without a key. */
#ifndef TENBAUD_BLAKE2B_H
#define TENBAUD_BLAKE2B_H

#include <stdint.h>

typedef struct {
    uint64_t chain[8];
    uint64_t count; /* bytes before those of `block` that have been compressed */
    uint8_t block[128];
    uint32_t filled;
    uint32_t size; /* of the digest */
} blake2b_state;

void blake2b_begin(blake2b_state *state, uint32_t digest_size);
void blake2b_add(blake2b_state *state, const uint8_t *bytes, uint32_t count);
void blake2b_end(blake2b_state *state, uint8_t *digest);

void blake2b(uint8_t *digest, uint32_t digest_size, const uint8_t *bytes, uint32_t count);

#endif
