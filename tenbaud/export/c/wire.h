/* Frames on the serial line: a byte for a symbol, a COBS frame with a checksum for everything else
 * (channel/links/serial/wire.py, channel/protocol/wire.py). */
#ifndef TENBAUD_WIRE_H
#define TENBAUD_WIRE_H

#include <stdbool.h>
#include <stdint.h>

#include "codec.h"
#include "terms.h"

#define WIRE_VERSION 2
#define WIRE_ERASED 0xFFFFu

enum {
    KIND_HELLO = 1,
    KIND_WELCOME = 2,
    KIND_REFUSE = 3,
    KIND_COMMANDS = 5,
    KIND_DESYNC = 6,
    KIND_BYE = 7,
    KIND_UNKNOWN = 8,
};

#define ECHO_BYTES (10 + 2 * CODEC_TICKS_PER_SAMPLE * CODEC_INPUTS)
#define COMMANDS_BYTES (13 + (TERMS_REPEATS + 1) * ECHO_BYTES)
#define WELCOME_BYTES (21 + 2 * CODEC_INPUTS + CODEC_BYTES)
/* Of longer frames, which are texts, the rest is not kept. */
#define FRAME_BYTES_MAX ((COMMANDS_BYTES > WELCOME_BYTES ? COMMANDS_BYTES : WELCOME_BYTES) + 64)

typedef struct {
    uint8_t bytes[FRAME_BYTES_MAX]; /* of the frame, checksum left out; fewer than `size` of a long one */
    uint32_t size;
    uint16_t checksum; /* of all but the last two bytes */
    uint8_t last[2];
    uint8_t code; /* bytes to the next zero that COBS has taken out */
    bool is_full_run;
    bool is_empty;
} wire_reader;

typedef struct {
    const uint8_t *bytes;
    uint32_t size;
    uint32_t at;
    bool is_short; /* more was read than is there */
} wire_fields;

void wire_begin(wire_reader *reader);
/* Takes a byte of the line; true where it ends a frame with a good checksum. */
bool wire_take(wire_reader *reader, uint8_t byte);
bool wire_is_notice(const wire_reader *reader);

uint32_t wire_number(wire_fields *fields, int bytes);
uint64_t wire_long_number(wire_fields *fields);
uint32_t wire_left(const wire_fields *fields);

/* Builds a frame of `count` bytes and sends it. `bytes` has room for two more. */
uint8_t *wire_put(uint8_t *to, uint64_t number, int bytes);
void wire_send(uint8_t *bytes, uint32_t count);
void wire_send_notice(uint8_t body);
void wire_send_symbol(uint32_t slot, uint8_t number);

#endif
