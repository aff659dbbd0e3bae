#include "client/src/state_decoding.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <string>

#include "drape/states.h"
#include "tests/client/client_test_support.h"

namespace drape {
namespace {

using client_test::ErrorOf;

// The value that the bits of a binary16 stand for, by IEEE 754-2019, 3.4.
double ValueOf(uint16_t half) {
  const double sign = half & 0x8000 ? -1 : 1;
  const int exponent = half >> 10 & 31;
  const double fraction = (half & 1023) / 1024.0;
  if (exponent == 0) return sign * std::pow(2, -14) * fraction;
  return sign * std::pow(2, exponent - 15) * (1 + fraction);
}

TEST(StateDecodingTest, EveryHalfIsExact) {
  for (uint32_t half = 0; half < 0x10000; ++half) {
    const float value = FloatOfHalf(static_cast<uint16_t>(half));
    if ((half >> 10 & 31) == 31) {
      EXPECT_EQ(std::isnan(value), (half & 1023) != 0);
      EXPECT_EQ(std::isinf(value), (half & 1023) == 0);
      if (std::isinf(value)) {
        EXPECT_EQ(value > 0, half < 0x8000);
      }
    } else {
      EXPECT_EQ(value, ValueOf(static_cast<uint16_t>(half))) << half;
    }
  }
}

// Two cloths of one and two particles, numbers 1 to 9.
v1::StateChunk EncodedChunk(v1::PackedArray::DataType type) {
  v1::StateChunk chunk;
  std::string data;
  for (int16_t k = 1; k <= 9; ++k) {
    uint16_t bits = static_cast<uint16_t>(k);
    if (type == v1::PackedArray::FLOAT16) {  // as a power of two
      bits = static_cast<uint16_t>(k << 10);
    }
    data.append(reinterpret_cast<const char*>(&bits), sizeof(bits));
  }
  for (const uint32_t count : {1u, 2u}) {
    chunk.add_cloth_ids(count);
    chunk.add_particle_counts(count);
    chunk.add_steps(0);
    chunk.add_times_s(0);
    for (const double origin : {100.0 * count, 0.0, -1.0}) chunk.add_origins_m(origin);
    if (type == v1::PackedArray::INT16) chunk.add_position_steps_m(0.5 * count);
  }
  v1::PackedArray* array = chunk.mutable_positions_m();
  array->set_data_type(type);
  array->add_shape(3);
  array->add_shape(3);
  array->set_data(data);
  return chunk;
}

TEST(StateDecodingTest, FixedNumbersAreOnTheGridOfTheirCloth) {
  const States states({EncodedChunk(v1::PackedArray::INT16)});
  EXPECT_EQ(states[0].positions_m.At(0, 0), 100.5);
  EXPECT_EQ(states[0].positions_m.At(0, 2), 0.5);
  EXPECT_EQ(states[1].positions_m.At(0, 0), 204);
  EXPECT_EQ(states[1].positions_m.At(1, 1), 8);
  EXPECT_EQ(states[1].positions_m.At(1, 2), 8);
}

TEST(StateDecodingTest, HalvesAreFromTheOriginOfTheEnvironment) {
  const States states({EncodedChunk(v1::PackedArray::FLOAT16)});
  EXPECT_EQ(states[0].positions_m.At(0, 1), std::ldexp(1, 2 - 15));
  EXPECT_EQ(states[1].positions_m.At(1, 0), 200 + std::ldexp(1, 7 - 15));
}

TEST(StateDecodingTest, ReductionsAreOfTheirCloth) {
  v1::StateChunk chunk = EncodedChunk(v1::PackedArray::INT16);
  for (int k = 0; k < 12; ++k) chunk.add_boxes_m(k);
  chunk.add_coverages_m2(5);
  chunk.add_coverages_m2(6);
  const States states({chunk});
  EXPECT_EQ(states[1].coverage_m2, 6);
  EXPECT_EQ(states[1].box_m, (std::array<double, 6>{6, 7, 8, 9, 10, 11}));
  EXPECT_FALSE(states[1].centroid_m.has_value());
  chunk.add_coverages_m2(7);
  EXPECT_EQ(ErrorOf([&] { States({chunk}); }).reason, "MALFORMED_STATES");
}

TEST(StateDecodingTest, WhatDoesNotBelongTogetherIsRefused) {
  const auto expect_malformed = [](auto spoil) {
    v1::StateChunk chunk = EncodedChunk(v1::PackedArray::INT16);
    spoil(chunk);
    EXPECT_EQ(ErrorOf([&] { States({chunk}); }).reason, "MALFORMED_STATES");
  };
  expect_malformed([](auto& chunk) { chunk.mutable_origins_m()->RemoveLast(); });
  expect_malformed([](auto& chunk) { chunk.clear_position_steps_m(); });
  expect_malformed([](auto& chunk) { chunk.mutable_positions_m()->mutable_data()->pop_back(); });
  expect_malformed([](auto& chunk) { chunk.set_particle_counts(0, 7); });
}

}  // namespace
}  // namespace drape
