#pragma once
#include "Arduino.h"

inline std::vector<int32_t *> encoder_counts;

class Encoder {
public:
  Encoder(int, int) { encoder_counts.push_back(&counts); }
  int32_t read() { return counts; }
  void write(int32_t value) { counts = value; }

private:
  int32_t counts = 0;
};
