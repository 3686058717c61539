// The same program on the machine that compiles it: nothing is counted, what it plays is compared.
#include <cstdint>
#include <cstdio>

extern "C" {
void write_host(const char* bytes, uint32_t count) { std::fwrite(bytes, 1, count, stdout); }
uint32_t counter() { return 0; }
}
