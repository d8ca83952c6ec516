// As much of an Arduino as the example sketch needs, with a clock and pins that a test sets.
#pragma once
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <deque>
#include <map>
#include <vector>

enum { LOW = 0, HIGH = 1, INPUT = 0, OUTPUT = 1, INPUT_PULLUP = 2 };

inline uint32_t clock_us = 0;
inline std::map<int, int> pins;

inline uint32_t micros() { return clock_us; }
inline void pinMode(int pin, int mode) {
  if (mode == INPUT_PULLUP && !pins.count(pin)) pins[pin] = LOW; // the emergency stop is closed
}
inline int digitalRead(int pin) { return pins[pin]; }
inline void digitalWrite(int pin, int value) { pins[pin] = value; }
inline void analogWrite(int pin, int value) { pins[pin] = value; }

struct FakeSerial {
  std::deque<uint8_t> in;
  std::vector<uint8_t> out;
  void begin(uint32_t) {}
  int available() { return (int)in.size(); }
  int read() {
    int value = in.front();
    in.pop_front();
    return value;
  }
  void write(const uint8_t *data, size_t count) { out.insert(out.end(), data, data + count); }
};
inline FakeSerial Serial;
