#include "server/gl/device_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace drape::gl {
namespace {

using testing::HasSubstr;

const std::vector<DeviceNames> kDevices = {
    {0, "0000:65:00.0", "GPU-0a1b2c3d-0000-1111-2222-333344445555", false},
    {1, "0000:b3:00.0", "GPU-0a1b9999-0000-1111-2222-333344445555", false},
    {2, "0001:65:00.0", "", false},
    {3, "", "", true}};

int IndexOf(std::string_view choice) {
  const Result<DeviceNames> found = FindDevice(choice, kDevices);
  return found.ok() ? found.value().index : -1;
}

TEST(DeviceChoiceTest, IndexPciAddressAndUuid) {
  EXPECT_EQ(IndexOf("0"), 0);
  EXPECT_EQ(IndexOf("3"), 3);
  EXPECT_EQ(IndexOf("65:00.0"), 0) << "domain 0 may be left out";
  EXPECT_EQ(IndexOf("0000:B3:00.0"), 1);
  EXPECT_EQ(IndexOf("0001:65:00.0"), 2);
  EXPECT_EQ(IndexOf("GPU-0a1b2c3d-0000-1111-2222-333344445555"), 0);
  EXPECT_EQ(IndexOf("0a1b9"), 1);
}

TEST(DeviceChoiceTest, WhatThereIsIsListed) {
  for (const char* choice : {"4", "66:00.0", "gpu-ffff", "0a1", "nvidia", ""}) {
    const Result<DeviceNames> found = FindDevice(choice, kDevices);
    ASSERT_FALSE(found.ok()) << choice;
    EXPECT_EQ(found.status().reason(), "NO_SUCH_DEVICE");
    EXPECT_THAT(found.status().message(), HasSubstr("\"" + std::string(choice) + "\""));
    EXPECT_THAT(found.status().message(), HasSubstr("1  0000:b3:00.0  GPU-0a1b9999"));
  }
  EXPECT_EQ(FindDevice("0a1b", kDevices).status().reason(), "AMBIGUOUS_DEVICE");
  EXPECT_THAT(FindDevice("0", {}).status().message(), HasSubstr("there is: none"));
}

TEST(DeviceChoiceTest, ADeviceOfThisMachineByItsIndex) {
  const std::vector<DeviceNames> devices = ListDevices();
  ASSERT_FALSE(devices.empty());
  const auto filter = FilterFor(std::to_string(devices.back().index));
  ASSERT_TRUE(filter.ok()) << filter.status().ToString();
  int accepted = 0;
  for (const EglDevice& device : ListEglDevices()) accepted += filter.value()(device) ? 1 : 0;
  EXPECT_EQ(accepted, 1);
  EXPECT_EQ(FilterFor("999").status().reason(), "NO_SUCH_DEVICE");
}

}  // namespace
}  // namespace drape::gl
