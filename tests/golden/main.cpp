// glibc picks variants of exp, sin and others by the processor, and those with fused multiply-add
// give other last bits. The hashes hold for the others, which every x86-64 has: this program
// selects them and starts itself again; servers that it starts inherit the choice.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  if (std::getenv("GLIBC_TUNABLES") == nullptr) {
    setenv("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-FMA,-FMA4", 1);
    execv("/proc/self/exe", argv);
    std::perror("golden_test cannot start itself again");
    return 1;
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
