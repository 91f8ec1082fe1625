// A reed board on an Arduino-class microcontroller (Uno, Nano, Mega, ...): pins around reed_scan.h and
// reed_protocol.h. What to solder is in docs/how-to/build-a-reed-board.md, what the lines say in
// docs/reference/reed-board.md.

#include "reed_protocol.h"

// --- your board ---------------------------------------------------------------------------------------------

#define IDENTITY "00000001"  // 8 hexadecimal digits, another one for each board that you build
#define WIRING_DIODES 1      // 8 x 8 matrix, a diode in series with each switch, cathode towards the row
#define WIRING_PLAIN 2       // 8 x 8 matrix without diodes: three corners of a rectangle feign the fourth
#define WIRING_DIRECT 3      // four multiplexers 16:1 (CD74HC4067), a switch at each input
#define WIRING WIRING_DIODES

#if WIRING == WIRING_DIRECT
const uint8_t SELECT[4] = {2, 3, 4, 5};    // S0 to S3 of all four multiplexers
const uint8_t COMMON[4] = {A0, A1, A2, A3};  // their outputs; the first has ranks 1 and 2, the last 7 and 8
#else
const uint8_t ROWS[8] = {2, 3, 4, 5, 6, 7, 8, 9};              // rank 1 to rank 8
const uint8_t COLUMNS[8] = {10, 11, 12, A0, A1, A2, A3, A4};  // a to h
#endif
const uint8_t BUZZER = 13;
// Lamps: 64 addressable lights (WS2812) on one pin, if there are any; a library of your choice draws them.
// #define LAMPS 1

// ------------------------------------------------------------------------------------------------------------

#if WIRING == WIRING_DIODES
#define WIRING_NAME "diodes"
#elif WIRING == WIRING_PLAIN
#define WIRING_NAME "plain"
#else
#define WIRING_NAME "direct"
#endif

struct Pins : reed::Outside {
  void send(const char* line, uint8_t length) override {
    Serial.write(reinterpret_cast<const uint8_t*>(line), length);
  }
  void light(const uint8_t* rows) override {
#ifdef LAMPS
    show_lamps(rows);  // yours: bit 0 of rows[0] is a1, bit 7 of rows[7] is h8
#else
    (void)rows;
#endif
  }
  void sound(const char* name) override {
    if (strcmp(name, "warn") == 0) {
      tone(BUZZER, 440, 400);
    } else if (strcmp(name, "ok") == 0) {
      tone(BUZZER, 880, 80);
    } else {
      noTone(BUZZER);
    }
  }
};

Pins pins;
reed::Board board(pins, IDENTITY, WIRING_NAME);

#if WIRING == WIRING_DIRECT

void set_up_pins() {
  for (uint8_t i = 0; i < 4; ++i) {
    pinMode(SELECT[i], OUTPUT);
    pinMode(COMMON[i], INPUT_PULLUP);  // a closed switch pulls its input to ground
  }
}

reed::Scan read_all() {
  reed::Scan scan = {{0}, {0}};
  for (uint8_t input = 0; input < 16; ++input) {
    for (uint8_t i = 0; i < 4; ++i) digitalWrite(SELECT[i], input >> i & 1);
    delayMicroseconds(5);
    for (uint8_t chip = 0; chip < 4; ++chip)
      if (digitalRead(COMMON[chip]) == LOW) scan.closed[2 * chip + (input >> 3)] |= 1 << (input & 7);
  }
  return scan;
}

#else

void set_up_pins() {
  for (uint8_t i = 0; i < 8; ++i) {
    pinMode(ROWS[i], INPUT_PULLUP);
    pinMode(COLUMNS[i], INPUT_PULLUP);
  }
}

// One row after the other is pulled to ground, all others are let go and read like the columns: one that goes
// low with it shows that a current has come back through a switch without diode.
reed::Scan read_all() {
  reed::Scan scan = {{0}, {0}};
  for (uint8_t row = 0; row < 8; ++row) {
    pinMode(ROWS[row], OUTPUT);
    digitalWrite(ROWS[row], LOW);
    delayMicroseconds(10);
    for (uint8_t column = 0; column < 8; ++column)
      if (digitalRead(COLUMNS[column]) == LOW) scan.closed[row] |= 1 << column;
    for (uint8_t other = 0; other < 8; ++other)
      if (other != row && digitalRead(ROWS[other]) == LOW) scan.live[row] |= 1 << other;
    pinMode(ROWS[row], INPUT_PULLUP);
  }
  return scan;
}

#endif

void setup() {
  Serial.begin(115200);
  set_up_pins();
  pinMode(BUZZER, OUTPUT);
  board.begin(read_all());
}

void loop() {
  static uint32_t last = 0;
  const uint32_t now = millis();
  while (Serial.available()) board.receive(now, static_cast<char>(Serial.read()));
  if (now == last) return;
  last = now;
  board.step(now, read_all());
}
