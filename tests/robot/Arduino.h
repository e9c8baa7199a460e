// As much of Arduino as the sketch uses, on a computer: the converter reads two bytes of standard input for each value, and
// ends the program where there are none; the clock begins at the microsecond in CLOCK and goes on by 100 with each look at it.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

using std::isnan;
typedef uint8_t byte;
const int A0 = 14;
const int HEX = 16;

class String {
  std::string text;

 public:
  String(const std::string &from) : text(from) {}
  String(const char *from) : text(from) {}
  String(uint16_t number) : text(std::to_string(number)) {}
  String(uint32_t number) : text(std::to_string(number)) {}
  String(float number, int digits) {
    char made[64];
    snprintf(made, sizeof made, "%.*f", digits, (double)number);
    text = made;
  }
  unsigned int length() const { return text.size(); }
  char operator[](unsigned int at) const { return text[at]; }
  String substring(unsigned int from) const { return text.substr(from); }
  String &operator+=(const String &more) { text += more.text; return *this; }
  friend String operator+(const String &a, const String &b) { return a.text + b.text; }
  const char *c_str() const { return text.c_str(); }
};

struct {
  void begin(unsigned long) {}
  void print(char one) { putchar(one); }
  void print(const String &text) { fputs(text.c_str(), stdout); }
  void println(byte number, int) { printf("%X\r\n", number); }
} Serial;

inline uint32_t micros() {
  static uint32_t clock = strtoul(getenv("CLOCK"), nullptr, 10);
  return clock += 100;
}

inline int analogRead(int pin) {
  int low = getchar(), high = getchar();
  if (pin < A0 || high == EOF) exit(0);
  return low + 256 * high;
}

void setup();
void loop();
int main() {
  setup();
  for (;;) loop();
}
