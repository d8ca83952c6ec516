/* What a board has to bring: five functions. None of them may wait. */
#ifndef TENBAUD_HARDWARE_H
#define TENBAUD_HARDWARE_H

#include <stdint.h>

/* The encoder of an output, in counts after quadrature. */
int32_t hardware_read_encoder(int output);

/* The motor of an input, in the unit of the model's input (V). */
void hardware_write_motor(int input, double value);

/* Nanoseconds since any moment; they never go back. */
uint64_t hardware_now_ns(void);

/* The next byte that came over the serial line, or -1. */
int hardware_read_byte(void);

/* Puts a byte on the serial line; dropped where there is no room. */
void hardware_write_byte(uint8_t byte);

#endif
