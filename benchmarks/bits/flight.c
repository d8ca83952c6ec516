/* The same as flight.py with an exported codec: golden vectors of the codec and of its functions, and a flight.
 *
 * Compiled with -DSAMPLES=n, for a system with standard output or, on Arm without one, for the board of qemu/.
 */
#include "codec.c" /* its translated sine, cosine and exponential too */

#include "golden.h"

enum { CHECKPOINTS = 10 };

#if defined(__arm__)
#include "board.h"
static void put(char one) {
    while (UART_FLAGS(0) & FLAG_NO_ROOM) continue;
    UART_DATA(0) = (uint32_t)one;
}
static void begin(void) {
    UART_LINE(0) = 0x70;
    UART_CONTROL(0) = 0x301;
}
/* The emulator ends with exit code 0. */
static void finish(void) {
    register uint32_t call __asm__("r0") = 0x18, reason __asm__("r1") = 0x20026;
    __asm__ volatile("bkpt 0xAB" : : "r"(call), "r"(reason));
}
#else
int putchar(int one);
static void put(char one) { putchar(one); }
static void begin(void) {}
static void finish(void) {}
#endif

static void put_text(const char *text) {
    while (*text) put(*text++);
}

static void put_number(uint64_t number, int base, int digits) {
    char text[20];
    int count = 0;
    for (; number > 0 || count < digits; number /= (uint64_t)base)
        text[count++] = "0123456789abcdef"[number % (uint64_t)base];
    while (count > 0) put(text[--count]);
}

static void put_count(const char *name, uint32_t count) {
    put_text(name);
    put_number(count, 10, 1);
    put('\n');
}

static uint64_t bits_of(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static uint32_t differing_numbers(void) {
    uint32_t differing = 0;
    for (int at = 0; at < GOLDEN_NUMBERS; at++) {
        double x, results[3];
        memcpy(&x, &golden_numbers[at].argument, sizeof x);
        entry_numbers(x, results);
        differing += bits_of(results[golden_numbers[at].function]) != golden_numbers[at].result;
    }
    return differing;
}

static uint32_t differing_samples(void) {
    uint32_t differing = 0;
    codec_state state;
    codec_initial(&state);
    for (int at = 0; at < GOLDEN_SAMPLES; at++) {
        const bool is_good =
            codec_step(&state, golden_words[at], golden_erased[at], golden_commands[at]);
        differing += !is_good || codec_digest(&state) != golden_digests[at];
    }
    return differing;
}

static uint32_t noise = 1;

static int32_t draw(uint32_t count) {
    noise = noise * 1664525u + 1013904223u;
    return (int32_t)((noise >> 8) % count);
}

/* Return whether it is erased. */
static bool word_at(const codec_state *state, int32_t *symbols) {
    const int32_t phase = (int32_t)(state->sample % 200);
    const double level = ((phase < 100 ? phase : 200 - phase) - 50) / 100.0;
    double measured[CODEC_ROOM(CODEC_MEASURED)];
    for (int place = 0; place < CODEC_MEASURED; place++)
        measured[place] = (place == 0 ? level : 0.0) + (draw(2001) - 1000) / 50000.0;
    const int32_t kind = draw(16);
    if (kind > 1 && codec_encode(state, measured, symbols)) return false;
    for (int at = 0; at < CODEC_SYMBOLS_PER_WORD; at++)
        symbols[at] = kind == 0 ? 0 : codec_alphabet[draw(CODEC_ALPHABET_SIZE)];
    return kind == 0;
}

static void fly(void) {
    static double commands[CODEC_TICKS_PER_SAMPLE * CODEC_INPUTS];
    int32_t symbols[CODEC_SYMBOLS_PER_WORD];
    codec_state state;
    uint64_t chain = 0;
    uint32_t failed = 0;
    codec_initial(&state);
    put_text("flight;c");
    for (uint32_t sample = 0; sample < SAMPLES; sample++) {
        const bool is_erased = word_at(&state, symbols);
        for (int at = 0; at < CODEC_TICKS_PER_SAMPLE * CODEC_INPUTS; at++)
            commands[at] = (draw(2001) - 1000) / 1000.0;
        if (!codec_step(&state, symbols, is_erased, commands)) {
            failed++;
            codec_initial(&state);
            state.sample = sample + 1;
        }
        chain = (chain ^ codec_digest(&state)) * 0x9E3779B97F4A7C15u;
        if ((sample + 1) % (SAMPLES / CHECKPOINTS) == 0) {
            put(';');
            put_number(chain, 16, 16);
        }
    }
    put_count(";", failed);
}

int main(void) {
    begin();
    put_count("golden;numerics;", differing_numbers());
    put_count("golden;codec;", differing_samples());
    fly();
    put_text("end\n");
    finish();
    return 0;
}
