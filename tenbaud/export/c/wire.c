#include "wire.h"

#include "hardware.h"

#define NOTICE 0xF3

static const uint8_t symbol_bytes[TERMS_SLOT_MODULUS][CODEC_ALPHABET_SIZE] = TERMS_SYMBOL_BYTES;

/* CRC-16/CCITT-FALSE */
static uint16_t checksum_after(uint16_t checksum, uint8_t byte) {
    checksum ^= (uint16_t)(byte << 8);
    for (int bit = 0; bit < 8; bit++)
        checksum = (uint16_t)(checksum & 0x8000u ? checksum << 1 ^ 0x1021u : checksum << 1);
    return checksum;
}

void wire_begin(wire_reader *reader) {
    reader->size = 0;
    reader->checksum = 0xFFFF;
    reader->code = 0;
    reader->is_full_run = true; /* no zero before the first run */
    reader->is_empty = true;
}

/* The last two bytes wait: they are the checksum. */
static void keep(wire_reader *reader, uint8_t byte) {
    if (reader->size >= 2) {
        const uint8_t old = reader->last[0];
        reader->checksum = checksum_after(reader->checksum, old);
        if (reader->size - 2 < FRAME_BYTES_MAX) reader->bytes[reader->size - 2] = old;
        reader->last[0] = reader->last[1];
        reader->last[1] = byte;
    } else {
        reader->last[reader->size] = byte;
    }
    reader->size++;
}

/* A zero in front only keeps the first code low (channel/links/serial/wire.py). */
static void put(wire_reader *reader, uint8_t byte) {
    if (byte == 0 && reader->size == 0 && reader->is_empty) {
        reader->is_empty = false;
        return;
    }
    reader->is_empty = false;
    keep(reader, byte);
}

bool wire_take(wire_reader *reader, uint8_t byte) {
    if (byte != 0) {
        if (reader->code == 0) {
            if (!reader->is_full_run) put(reader, 0);
            reader->is_full_run = byte == 0xFF;
            reader->code = byte;
        } else {
            put(reader, byte);
        }
        reader->code--;
        return false;
    }
    const bool is_whole = reader->code == 0 && reader->size > 2;
    const uint16_t sent = (uint16_t)(reader->last[0] | reader->last[1] << 8);
    const bool is_good = is_whole && reader->checksum == sent;
    if (is_good) reader->size -= 2;
    return is_good;
}

bool wire_is_notice(const wire_reader *reader) { return reader->bytes[0] == NOTICE; }

uint64_t wire_long_number(wire_fields *fields) {
    const uint64_t low = wire_number(fields, 4);
    return low | (uint64_t)wire_number(fields, 4) << 32;
}

uint32_t wire_number(wire_fields *fields, int bytes) {
    uint32_t number = 0;
    for (int at = 0; at < bytes; at++) {
        if (fields->at >= fields->size) {
            fields->is_short = true;
            return 0;
        }
        number |= (uint32_t)fields->bytes[fields->at++] << 8 * at;
    }
    return number;
}

uint32_t wire_left(const wire_fields *fields) { return fields->size - fields->at; }

uint8_t *wire_put(uint8_t *to, uint64_t number, int bytes) {
    for (int at = 0; at < bytes; at++) *to++ = (uint8_t)(number >> 8 * at);
    return to;
}

/* COBS: each run without a zero is preceded by its length plus one, a full one of 254 by 255. */
static void stuff(const uint8_t *bytes, uint32_t count) {
    uint32_t at = 0;
    for (;;) {
        uint32_t run = 0;
        while (run < 254 && at + run < count && bytes[at + run] != 0) run++;
        hardware_write_byte((uint8_t)(run + 1));
        for (uint32_t place = 0; place < run; place++) hardware_write_byte(bytes[at + place]);
        at += run;
        if (at == count) return;
        if (run < 254) at++;
    }
}

void wire_send(uint8_t *bytes, uint32_t count) {
    uint16_t checksum = 0xFFFF;
    uint32_t first = 0;
    for (uint32_t at = 0; at < count; at++) checksum = checksum_after(checksum, bytes[at]);
    wire_put(bytes + count, checksum, 2);
    count += 2;
    hardware_write_byte(0);
    while (first < count && bytes[first] != 0) first++;
    if (first >= 127) hardware_write_byte(1); /* a zero in front, so that the first code is no symbol */
    stuff(bytes, count);
    hardware_write_byte(0);
}

void wire_send_notice(uint8_t body) {
    uint8_t bytes[4] = {NOTICE, body};
    wire_send(bytes, 2);
}

void wire_send_symbol(uint32_t slot, uint8_t number) {
    hardware_write_byte(symbol_bytes[slot % TERMS_SLOT_MODULUS][number]);
}
