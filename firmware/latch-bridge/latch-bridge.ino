// A small serial bridge for arms of the Lab-Volt 5100 family: steppers behind parallel latches, four phase bits
// for each motor. Protocol: docs/reference/latch-bridge.md, version 1. A board with 8 kB of RAM (Arduino Mega
// class) holds the queue.
//
// This is a sketch in both senses: the step logic is tested on a computer, the wiring below was never tried on
// an arm. Check PINS, the order of the phases and the switches' polarity before you connect motors.

#include "step_logic.h"

using namespace kempelen;

// --- wiring ---------------------------------------------------------------------------------------------------

const uint8_t DATA[4] = {22, 23, 24, 25};     // phase bits, to all latches
const uint8_t ADDRESS[3] = {26, 27, 28};      // which latch
const uint8_t STROBE = 29;                    // a rising edge takes the data over
const uint8_t SWITCH[MOTORS] = {30, 31, 32, 33, 34};  // reference switches, closed = LOW
const uint8_t GRIPPER = 35;                   // HIGH = current = open: without current it is closed
const uint32_t BAUD = 115200;

// --- state ----------------------------------------------------------------------------------------------------

enum State : uint8_t { IDLE, RUN, JOG, HOME, HOLD, ALARM };
const char* const NAMES[] = {"Idle", "Run", "Jog", "Home", "Hold", "Alarm"};

enum Phase : uint8_t { LEAVE, SEEK, BACK, TOUCH, OFF, DONE };

struct Search {
  uint8_t motor;
  int8_t way;
  uint16_t rate, slow;
  uint32_t off, most, made;
  int32_t home, closed_at;
  uint16_t waiting;
  Phase phase;
};

StepLogic logic;
volatile State state = ALARM;
Search seek;
bool gripper_open = false, wanted_open = false, known = false, cancelling = false;
uint8_t expected = 0, pending_number = 0;
char pending = 0;             // letter of the command that is being waited for
Block pending_block;
uint32_t wait_until = 0;
bool waiting = false;
char line[100];
uint8_t length = 0;

// --- outputs --------------------------------------------------------------------------------------------------

void write_latch(uint8_t motor, uint8_t nibble) {
  for (uint8_t bit = 0; bit < 4; ++bit) digitalWrite(DATA[bit], nibble >> bit & 1);
  for (uint8_t bit = 0; bit < 3; ++bit) digitalWrite(ADDRESS[bit], motor >> bit & 1);
  digitalWrite(STROBE, HIGH);
  digitalWrite(STROBE, LOW);
}

bool closed(uint8_t motor) { return digitalRead(SWITCH[motor]) == LOW; }

void set_gripper(bool open) {
  gripper_open = open;
  digitalWrite(GRIPPER, open ? HIGH : LOW);
}

void say(const char* text) {
  uint16_t crc = 0xFFFF;
  for (const char* c = text; *c; ++c) crc = crc16(crc, *c);
  char end[8];
  snprintf(end, sizeof end, "*%04X\r\n", crc);
  Serial.print(text);
  Serial.print(end);
}

void say_ok(uint8_t number) {
  char text[12];
  snprintf(text, sizeof text, "ok %u", number);
  say(text);
}

void say_error(uint8_t code) {
  char text[20];
  snprintf(text, sizeof text, "error %u %u", code, expected);
  say(text);
}

void greet() {
  char text[48];
  snprintf(text, sizeof text, "Kempelen latch bridge 1, %d motors", MOTORS);
  say(text);
}

void report() {
  char text[128], pins[MOTORS + 1];
  uint8_t pressed = 0;
  for (uint8_t motor = 0; motor < MOTORS; ++motor)
    if (closed(motor)) pins[pressed++] = "XYZABC"[motor];
  pins[pressed] = 0;
  int at = snprintf(text, sizeof text, "<%s%s|P:", NAMES[state], state == HOLD ? (logic.pace() ? ":1" : ":0") : "");
  for (uint8_t motor = 0; motor < MOTORS; ++motor) {
    noInterrupts();
    const int32_t count = logic.count(motor);
    interrupts();
    at += snprintf(text + at, sizeof text - at, motor ? ",%ld" : "%ld", static_cast<long>(count));
  }
  snprintf(text + at, sizeof text - at, "|Q:%u|L:%s|G:%c|K:%d>", logic.room(), pins, gripper_open ? 'o' : 'c', known);
  say(text);
}

// --- stopping -------------------------------------------------------------------------------------------------

void forget() {
  noInterrupts();
  logic.drop();
  interrupts();
  set_gripper(false);
  expected = 0;
  pending = 0;
  length = 0;
  known = cancelling = waiting = false;
}

void alarm(uint8_t code) {
  char text[12];
  snprintf(text, sizeof text, "alarm %u", code);
  say(text);
  state = ALARM;
  forget();
  greet();
}

void reset() {
  if (state == HOME) return alarm(6);
  if (logic.running() && state != IDLE) return alarm(3);
  const State after = state == ALARM ? ALARM : IDLE;
  forget();
  state = after;
  greet();
}

void at_once(uint8_t byte) {
  if (byte == '?') report();
  if (byte == 0x18) reset();
  if (byte == '!' && (state == RUN || state == JOG)) {
    logic.hold();
    if (state == RUN) state = HOLD; else cancelling = true;
  }
  if (byte == 0x85 && state == JOG) {
    logic.hold();
    cancelling = true;
  }
}

// --- the timer: 4,000 times a second --------------------------------------------------------------------------

void begin(Phase phase) {
  seek.phase = phase;
  seek.made = 0;
  seek.waiting = 0;
}

void search_tick() {
  const uint16_t rate = seek.phase == TOUCH ? seek.slow : seek.rate;
  const uint16_t interval = rate < 4000 ? 4000 / rate : 1;
  const bool back = seek.phase == BACK || seek.phase == OFF;
  if (back ? seek.made >= seek.off : closed(seek.motor) == (seek.phase != LEAVE)) return;
  if (++seek.waiting < interval) return;
  seek.waiting = 0;
  ++seek.made;
  const int8_t step = seek.phase == SEEK || seek.phase == TOUCH ? seek.way : -seek.way;
  const int32_t count = logic.count(seek.motor) + step;
  logic.name(seek.motor, count);
  write_latch(seek.motor, phase_nibble(count));
}

ISR(TIMER1_COMPA_vect) {
  if (state == HOME) return search_tick();
  const uint8_t stepped = logic.tick();
  for (uint8_t motor = 0; motor < MOTORS; ++motor)
    if (stepped >> motor & 1) write_latch(motor, phase_nibble(logic.count(motor)));
}

// --- homing, between ticks ------------------------------------------------------------------------------------

void search() {
  if (state != HOME) return;
  noInterrupts();
  const uint32_t made = seek.made;
  interrupts();
  const bool pressed = closed(seek.motor);
  if (seek.phase == BACK || seek.phase == OFF) {
    if (made < seek.off) return;
    if (pressed) return alarm(8);
  } else if (pressed == (seek.phase != LEAVE)) {
    seek.closed_at = logic.count(seek.motor);
  } else {
    if (made >= seek.most) alarm(pressed ? 8 : 9);
    return;
  }
  noInterrupts();
  begin(static_cast<Phase>(seek.phase + 1));
  if (seek.phase == DONE) {
    logic.name(seek.motor, seek.home);
    state = IDLE;
  }
  interrupts();
  if (seek.phase != DONE) return;
  char text[24];
  snprintf(text, sizeof text, "[HOM:%ld]", static_cast<long>(seek.closed_at));
  say(text);
}

// --- commands -------------------------------------------------------------------------------------------------

// Values after the letter; -1 when one is no number or there are too many.
int read_values(char* text, int32_t* values, int most) {
  int count = 0;
  for (char* word = strtok(text, " "); word; word = strtok(nullptr, " ")) {
    char* end;
    if (count == most) return -1;
    values[count++] = strtol(word, &end, 10);
    if (*end) return -1;
  }
  return count;
}

uint8_t read_block(const int32_t* values, int count, Block* block) {
  if (count != MOTORS + 1) return 1;
  if (values[0] < 1 || values[0] > LONGEST_MS) return 2;
  block->milliseconds = values[0];
  for (uint8_t motor = 0; motor < MOTORS; ++motor) {
    if (values[motor + 1] > 32767 || values[motor + 1] < -32767) return 3;
    block->steps[motor] = values[motor + 1];
  }
  return StepLogic::possible(*block) ? 0 : 3;
}

// Begin a command: an error's code, 0 when it is done, 255 when it has to be waited for.
uint8_t begin_command(char letter, const int32_t* values, int count) {
  const uint8_t busy = state == ALARM ? 9 : 8;
  Block block;
  uint8_t wrong;
  switch (letter) {
    case 'I': {
      char text[16];
      say("[VER:1]");
      snprintf(text, sizeof text, "[AXS:%d]", MOTORS);
      say(text);
      snprintf(text, sizeof text, "[QUE:%d]", QUEUE);
      say(text);
      return 0;
    }
    case 'B':
      if ((wrong = read_block(values, count, &pending_block))) return wrong;
      return state == IDLE || state == RUN || state == HOLD ? 255 : busy;
    case 'J':
      if ((wrong = read_block(values, count, &block))) return wrong;
      if (state != IDLE && state != JOG) return busy;
      if (cancelling) return 0;
      noInterrupts();
      logic.push(block);
      state = JOG;
      interrupts();
      return 0;
    case 'E':
      return state == ALARM ? 9 : 255;
    case 'W':
      if (count != 1 || values[0] < 0) return 1;
      wait_until = values[0];
      waiting = false;
      return 255;
    case 'G':
      if (count != 1 || values[0] < 0 || values[0] > 1) return 2;
      wanted_open = values[0] == 0;
      return 255;
    case 'H':
      if (count != 7) return 1;
      if (values[0] < 0 || values[0] >= MOTORS || (values[1] != 1 && values[1] != -1)) return 2;
      if (values[2] < 1 || values[3] < 1 || values[4] < 1 || values[5] < 1) return 2;
      if (values[2] > 4000 || values[3] > 4000) return 3;
      if (state != IDLE && state != ALARM) return 8;
      noInterrupts();
      seek.motor = values[0];
      seek.way = values[1];
      seek.rate = values[2];
      seek.slow = values[3];
      seek.off = values[4];
      seek.most = values[5];
      seek.home = values[6];
      begin(LEAVE);
      state = HOME;
      interrupts();
      return 255;
    case 'X':
      if (state == ALARM) state = IDLE;
      return 0;
    case 'K':
      known = true;
      return 0;
  }
  return 1;
}

// Whether the command that is waited for is done by now.
bool done() {
  switch (pending) {
    case 'B': {
      noInterrupts();
      const bool pushed = logic.push(pending_block);
      if (pushed && state == IDLE) state = RUN;
      interrupts();
      return pushed;
    }
    case 'E':
      return state == IDLE;
    case 'W':
      if (state != IDLE) return false;
      if (!waiting) wait_until += millis();
      waiting = true;
      return static_cast<int32_t>(millis() - wait_until) >= 0;
    case 'G':
      if (state != IDLE && state != ALARM) return false;
      set_gripper(wanted_open);
      return true;
    case 'H':
      return state != HOME;
  }
  return true;
}

bool checked(char* text) {
  char* star = strrchr(text, '*');
  if (!star || strlen(star) != 5) return false;
  uint16_t crc = 0xFFFF;
  for (char* c = text; c < star; ++c) crc = crc16(crc, *c);
  char digits[5];
  snprintf(digits, sizeof digits, "%04X", crc);
  if (strcmp(digits, star + 1)) return false;
  *star = 0;
  return true;
}

void resume() {
  if (state != HOLD || logic.pace()) return;
  noInterrupts();
  logic.resume();
  state = logic.empty() ? IDLE : RUN;
  interrupts();
}

void execute(char* text) {
  if (!checked(text)) return say_error(101);
  char* rest;
  const long number = strtol(text, &rest, 10);
  if (rest == text || *rest != ' ' || !rest[1]) return say_error(1);
  if (number != 0 && number != expected) return say_error(102);
  expected = number % 255 + 1;
  int32_t values[8];
  const int count = read_values(rest + 2, values, 8);
  const uint8_t outcome = count < 0 ? 1 : begin_command(rest[1], values, count);
  if (outcome == 0) return say_ok(number);
  if (outcome != 255) return say_error(outcome);
  pending = rest[1];
  pending_number = number;
}

// --- main -----------------------------------------------------------------------------------------------------

// Lines wait here while a command is waited for; a resume passes them.
char ring[128];
uint8_t held = 0;

void read_serial() {
  while (Serial.available()) {
    const uint8_t byte = Serial.read();
    if (byte == '?' || byte == '!' || byte == 0x18 || byte == 0x85) {
      at_once(byte);
    } else if (held < sizeof ring) {
      ring[held++] = byte;
    }
  }
}

// Take the line that begins at `from` out of the ring; its length, 0 when it is not complete yet.
uint8_t take_line(uint8_t from) {
  for (uint8_t end = from; end < held; ++end) {
    if (ring[end] != '\n') continue;
    const bool fits = end - from < static_cast<int>(sizeof line);
    length = fits ? end - from : 0;
    if (!fits) say_error(103);
    memcpy(line, ring + from, length);
    while (length && line[length - 1] == '\r') --length;
    line[length] = 0;
    memmove(ring + from, ring + end + 1, held - end - 1);
    held -= end + 1 - from;
    return 1;
  }
  return 0;
}

void look_for_resume() {
  for (uint8_t at = 0; at + 6 < held; ++at) {
    if (ring[at] != '~' || (at && ring[at - 1] != '\n')) continue;
    if (take_line(at) && checked(line) && !strcmp(line, "~")) resume();
    return;
  }
}

void setup() {
  for (uint8_t pin : DATA) pinMode(pin, OUTPUT);
  for (uint8_t pin : ADDRESS) pinMode(pin, OUTPUT);
  for (uint8_t pin : SWITCH) pinMode(pin, INPUT_PULLUP);
  pinMode(STROBE, OUTPUT);
  pinMode(GRIPPER, OUTPUT);
  set_gripper(false);
  for (uint8_t motor = 0; motor < MOTORS; ++motor) write_latch(motor, phase_nibble(0));
  Serial.begin(BAUD);
  noInterrupts();
  TCCR1A = 0;
  TCCR1B = _BV(WGM12) | _BV(CS11);  // 16 MHz / 8
  OCR1A = 499;                      // 4 kHz
  TIMSK1 = _BV(OCIE1A);
  interrupts();
  greet();
}

void loop() {
  read_serial();
  search();
  if (cancelling && !logic.pace()) {
    noInterrupts();
    logic.drop();
    interrupts();
  }
  if ((state == RUN || state == JOG || state == HOLD) && logic.empty()) {
    state = IDLE;
    cancelling = false;
  }
  look_for_resume();
  if (pending && done()) {
    pending = 0;
    say_ok(pending_number);
  }
  if (!pending && take_line(0) && length) execute(line);
}
