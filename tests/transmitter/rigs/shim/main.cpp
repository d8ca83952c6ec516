// Runs the sketch step by step. One line of input, one line of answer:
//   T us        set the clock          C i counts   turn an encoder       P pin value  set a pin
//   R hex       bytes arrive           L            run loop() once; answer: bytes written, as hex
//   G pin       answer: value of a pin
#include "Arduino.h"
#include SKETCH
#include <iostream>
#include <sstream>
#include <string>

int main() {
  setup();
  std::string line;
  while (std::getline(std::cin, line)) {
    std::istringstream words(line);
    char what;
    long a = 0, b = 0;
    words >> what;
    std::string answer = "ok";
    if (what == 'T') {
      words >> a;
      clock_us = (uint32_t)a;
    } else if (what == 'C') {
      words >> a >> b;
      *encoder_counts[a] = (int32_t)b;
    } else if (what == 'P') {
      words >> a >> b;
      pins[(int)a] = (int)b;
    } else if (what == 'G') {
      words >> a;
      answer = std::to_string(pins[(int)a]);
    } else if (what == 'R') {
      std::string hex;
      words >> hex;
      for (size_t i = 0; i + 1 < hex.size(); i += 2)
        Serial.in.push_back((uint8_t)std::stoi(hex.substr(i, 2), nullptr, 16));
    } else if (what == 'L') {
      loop();
      answer.clear();
      char text[3];
      for (uint8_t value : Serial.out) {
        snprintf(text, sizeof text, "%02x", value);
        answer += text;
      }
      Serial.out.clear();
    }
    std::cout << answer << std::endl;
  }
}
