// Sends samples as `feeler robot stream /dev/ttyUSB0 --serial` reads them, one line each:
//   $number,time_ms,value,value,...*checksum
// The number rises by one and wraps at 65536; the time is that of a clock of 32 bits, which begins anew after 71.6 minutes; the
// checksum is the exclusive or of all bytes between $ and *. A slow line only delays: whatever is lost, doubled or broken on the
// way is known at the other end.

const int CHANNELS = 8;
const int RATE = 500;  // samples per second; a line has about 12 + 8 characters per channel, a character takes 10 bits
const unsigned long BAUD = 115200;  // what feeler opens; native USB ignores it, 8 channels on a UART allow about 150 per second
const uint32_t PERIOD = 1000000UL / RATE;  // us

uint32_t next_us;
uint16_t number = 0;

// Your converter: capacitance, or angle, in the unit of your calibration; NAN where there is none.
float read_channel(int channel) {
  return analogRead(A0 + channel);
}

void send(const String &body) {
  byte sum = 0;
  for (unsigned int i = 0; i < body.length(); i++) sum ^= (byte)body[i];
  Serial.print('$');
  Serial.print(body);
  Serial.print('*');
  if (sum < 16) Serial.print('0');
  Serial.println(sum, HEX);
}

void setup() {
  Serial.begin(BAUD);
  next_us = micros();
}

void loop() {
  uint32_t now = micros();
  if ((int32_t)(now - next_us) < 0) return;
  next_us += PERIOD;
  if ((int32_t)(now - next_us) > 0) next_us = now;  // too slow a line: do not fall behind for ever
  String body = String(number++) + "," + String(now / 1000) + "." + String(1000 + now % 1000).substring(1);
  for (int channel = 0; channel < CHANNELS; channel++) {
    float value = read_channel(channel);
    body += isnan(value) ? String(",nan") : "," + String(value, 4);
  }
  send(body);
}
