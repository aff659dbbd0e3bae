#include "server/solver/gl_compute/local_sizes.h"

#include <gtest/gtest.h>

#include <bit>
#include <string>

namespace drape {
namespace {

constexpr LocalSizes AllOf(uint32_t all) {
  return {.resident_64 = all,
          .resident_256 = all,
          .resident_1024 = all,
          .tiled = all,
          .refine = all,
          .contacts = all,
          .general = all};
}

TEST(LocalSizesTest, ANamedDeviceBeforeAnyOfItsKind) {
  const DeviceSizes table[] = {
      {.is_software = false, .renderer = "Radeon", .sizes = AllOf(64)},
      {.is_software = true, .renderer = "", .sizes = AllOf(8)},
      {.is_software = false, .renderer = "", .sizes = AllOf(128)},
  };
  EXPECT_EQ(FindLocalSizes(table, false, "AMD Radeon RX 7900 (navi31)").tiled, 64u);
  EXPECT_EQ(FindLocalSizes(table, false, "NVIDIA H200/PCIe").tiled, 128u);
  EXPECT_EQ(FindLocalSizes(table, false, "").tiled, 128u);
  EXPECT_EQ(FindLocalSizes(table, true, "llvmpipe (LLVM 15.0.6, 256 bits)").tiled, 8u);
  EXPECT_EQ(FindLocalSizes(table, true, "a Radeon that is emulated").tiled, 8u);
}

TEST(LocalSizesTest, SizesByCapacity) {
  const LocalSizes sizes = {
      .resident_64 = 1, .resident_256 = 2, .resident_1024 = 3, .tiled = 4, .refine = 5};
  EXPECT_EQ(sizes.ForCapacity(64), 1u);
  EXPECT_EQ(sizes.ForCapacity(256), 2u);
  EXPECT_EQ(sizes.ForCapacity(1024), 3u);
  EXPECT_EQ(sizes.ForCapacity(0), 4u);
}

TEST(LocalSizesTest, EveryRowIsWhatDevicesOffer) {
  for (const DeviceSizes& row : MeasuredLocalSizes()) {
    const LocalSizes& s = row.sizes;
    for (const uint32_t size : {s.resident_64, s.resident_256, s.resident_1024, s.tiled, s.refine,
                                s.contacts, s.general}) {
      EXPECT_TRUE(std::has_single_bit(size)) << row.renderer;
      EXPECT_LE(size, 1024u);
    }
    EXPECT_LE(s.general, 256u) << "52 bytes each of shared memory in measure_pieces";
  }
  for (const bool is_software : {false, true}) {
    EXPECT_GT(FindLocalSizes(MeasuredLocalSizes(), is_software, "any").tiled, 0u);
  }
}

}  // namespace
}  // namespace drape
