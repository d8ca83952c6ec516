// A rig's board for tenbaud, format "cobs": encoder counts out, motor voltages in.
//
// Written for a Teensy with the library "Encoder" (PJRC); any Arduino with two PWM pins, two direction
// pins and interrupt pins for the encoders will do. What to change is in the first block.
//
// Every frame is: payload, CRC-16/CCITT-FALSE of it (low byte first), COBS, then a zero byte.
//   SAMPLE   0x01, flags, sequence u16, t_us u32, counts of channels 0, 1, 2 as i32        (little-endian)
//   COMMAND  0x81, flags (1 enable, 2 zero the encoders), sequence u16, two voltages as float
//
// The watchdog below is the one that matters: it sits beside the motors. Without a command for
// WATCHDOG_US the outputs go off, and stay off until a command without the enable bit has come: arming
// again is on purpose. It is no emergency stop; that one cuts the amplifier's supply by hand.

#include <Encoder.h>

// ---- wiring and limits: change these -------------------------------------------------------------
static const uint32_t LINE_BAUD = 115200;      // ignored by boards with USB of their own
static const uint32_t SAMPLE_PERIOD_US = 2084; // 480 samples/s, what 115200 baud carries
static const uint32_t WATCHDOG_US = 100000;
static const float SUPPLY_VOLTS = 12.0f;       // what full PWM gives
static const float VOLTS_MAX = 5.0f;           // never more than this at a motor, whoever asks
static const int PWM_PIN[2] = {5, 6};          // front, rear
static const int DIRECTION_PIN[2] = {7, 8};
static const int ENABLE_PIN = 9;               // of the amplifier
static const int ESTOP_PIN = 10;               // closed to ground while all is well
static Encoder travel(0, 1), pitch(2, 3), elevation(14, 15);
// ---------------------------------------------------------------------------------------------------

static const uint8_t SAMPLE = 0x01, COMMAND = 0x81;
static const uint8_t ESTOP_OPEN = 1, WATCHDOG_TRIPPED = 2, OUTPUT_ENABLED = 8;
static const uint8_t ENABLE = 1, ZERO_ENCODERS = 2;
static const uint8_t SAMPLE_BYTES = 20, COMMAND_BYTES = 12;

static bool enabled = false, tripped = false;
static uint16_t sequence = 0;
static uint32_t heardAt = 0, sampledAt = 0;
static uint8_t incoming[32];
static uint8_t incomingCount = 0;
static bool tooLong = false;

static uint16_t crc16(const uint8_t *data, uint8_t count) {
  uint16_t crc = 0xFFFF;
  for (uint8_t i = 0; i < count; i++) {
    crc ^= (uint16_t)data[i] << 8;
    for (uint8_t bit = 0; bit < 8; bit++)
      crc = crc & 0x8000 ? (crc << 1) ^ 0x1021 : crc << 1;
  }
  return crc;
}

static void setMotor(int motor, float volts) {
  if (volts > VOLTS_MAX) volts = VOLTS_MAX;
  if (volts < -VOLTS_MAX) volts = -VOLTS_MAX;
  digitalWrite(DIRECTION_PIN[motor], volts >= 0 ? HIGH : LOW);
  analogWrite(PWM_PIN[motor], (int)((volts >= 0 ? volts : -volts) / SUPPLY_VOLTS * 255.0f + 0.5f));
}

static void outputsOff() {
  enabled = false;
  setMotor(0, 0);
  setMotor(1, 0);
  digitalWrite(ENABLE_PIN, LOW);
}

static bool estopOpen() { return digitalRead(ESTOP_PIN) == HIGH; }

static void sendFrame(const uint8_t *payload, uint8_t count) {
  uint8_t data[SAMPLE_BYTES + 2], frame[SAMPLE_BYTES + 5];
  memcpy(data, payload, count);
  uint16_t crc = crc16(payload, count);
  data[count] = crc & 0xFF;
  data[count + 1] = crc >> 8;
  // COBS: every zero becomes the distance to the next one. Our frames are shorter than 254 bytes.
  uint8_t codeAt = 0, length = 1;
  for (uint8_t i = 0; i < count + 2; i++) {
    if (data[i]) {
      frame[length++] = data[i];
    } else {
      frame[codeAt] = length - codeAt;
      codeAt = length++;
    }
  }
  frame[codeAt] = length - codeAt;
  frame[length++] = 0;
  Serial.write(frame, length);
}

static void sendSample(uint32_t now) {
  uint8_t payload[SAMPLE_BYTES];
  int32_t counts[3] = {(int32_t)travel.read(), (int32_t)pitch.read(), (int32_t)elevation.read()};
  sequence++;
  payload[0] = SAMPLE;
  payload[1] = (estopOpen() ? ESTOP_OPEN : 0) | (tripped ? WATCHDOG_TRIPPED : 0) |
               (enabled ? OUTPUT_ENABLED : 0);
  memcpy(payload + 2, &sequence, 2); // these boards are little-endian, as the frame is
  memcpy(payload + 4, &now, 4);
  memcpy(payload + 8, counts, 12);
  sendFrame(payload, SAMPLE_BYTES);
}

static void takeCommand(const uint8_t *payload) {
  float volts[2];
  memcpy(volts, payload + 4, 8);
  if (volts[0] != volts[0] || volts[1] != volts[1]) return; // not a number: as if it had not come
  heardAt = micros();
  if (payload[1] & ZERO_ENCODERS) {
    travel.write(0);
    pitch.write(0);
    elevation.write(0);
  }
  if (!(payload[1] & ENABLE)) {
    tripped = false;
    outputsOff();
    return;
  }
  if (tripped || estopOpen()) return;
  setMotor(0, volts[0]);
  setMotor(1, volts[1]);
  enabled = true;
  digitalWrite(ENABLE_PIN, HIGH);
}

static void takeFrame() {
  uint8_t data[sizeof incoming];
  uint8_t count = 0, at = 0;
  while (at < incomingCount) {
    uint8_t code = incoming[at++];
    if (at + code - 1 > incomingCount) return; // a code that points past the end: damaged
    for (uint8_t i = 1; i < code; i++) data[count++] = incoming[at++];
    if (at < incomingCount) data[count++] = 0;
  }
  if (count != COMMAND_BYTES + 2 || data[0] != COMMAND) return;
  if (crc16(data, COMMAND_BYTES) != (uint16_t)(data[count - 2] | data[count - 1] << 8)) return;
  takeCommand(data);
}

void setup() {
  for (int motor = 0; motor < 2; motor++) {
    pinMode(PWM_PIN[motor], OUTPUT);
    pinMode(DIRECTION_PIN[motor], OUTPUT);
  }
  pinMode(ENABLE_PIN, OUTPUT);
  pinMode(ESTOP_PIN, INPUT_PULLUP);
  outputsOff();
  Serial.begin(LINE_BAUD);
}

void loop() {
  while (Serial.available()) {
    uint8_t byte = Serial.read();
    if (byte == 0) {
      if (!tooLong && incomingCount) takeFrame();
      incomingCount = 0;
      tooLong = false;
    } else if (incomingCount < sizeof incoming) {
      incoming[incomingCount++] = byte;
    } else {
      tooLong = true;
    }
  }
  uint32_t now = micros();
  if (enabled && now - heardAt > WATCHDOG_US) {
    tripped = true;
    outputsOff();
  }
  if (enabled && estopOpen()) outputsOff();
  if (now - sampledAt >= SAMPLE_PERIOD_US) {
    // The grid goes on from where it was, unless the board was held up for long.
    sampledAt = now - sampledAt < 2 * SAMPLE_PERIOD_US ? sampledAt + SAMPLE_PERIOD_US : now;
    sendSample(now);
  }
}
