#include "drape/states.h"

#include <gtest/gtest.h>

#include <numeric>
#include <utility>

#include "tests/client/client_test_support.h"

namespace drape {
namespace {

using client_test::ErrorOf;
using client_test::MakeChunk;
using client_test::MakeStates;

template <class Element>
std::vector<Element> Counting(size_t count, Element first) {
  std::vector<Element> elements(count);
  std::iota(elements.begin(), elements.end(), first);
  return elements;
}

TEST(StatesTest, EachClothSeesItsOwnRows) {
  const States states = MakeStates({2, 0, 1}, 7, Counting<float>(9, 0), Counting<float>(9, 100));
  ASSERT_EQ(states.size(), 3u);
  EXPECT_EQ(states[0].cloth_id, 100u);
  EXPECT_EQ(states[0].step, 7u);
  EXPECT_DOUBLE_EQ(states[0].time_s, 0.7);
  EXPECT_EQ(states[0].positions_m.row_count(), 2u);
  EXPECT_EQ(states[0].positions_m.At(1, 2), 5);
  EXPECT_TRUE(states[1].positions_m.empty());
  EXPECT_EQ(states[2].positions_m.At(0, 0), 6);
  EXPECT_EQ(states[2].velocities_m_per_s.At(0, 1), 107);
}

TEST(StatesTest, DoublesKeepTheirPrecision) {
  const double third = 1.0 / 3;
  const States states = MakeStates<double>({1}, 1, {third, 2 * third, 1}, {});
  ASSERT_TRUE(states[0].positions_m.is_float64());
  EXPECT_EQ(states[0].positions_m.doubles()[1], 2 * third);
  EXPECT_TRUE(states[0].positions_m.floats().empty());
  EXPECT_TRUE(states[0].velocities_m_per_s.empty());
}

TEST(StatesTest, ViewsAreNoCopiesAndSurviveAMove) {
  States states = MakeStates({2}, 1, Counting<float>(6, 1), {});
  const float* before = states[0].positions_m.floats().data();
  const States moved = std::move(states);
  EXPECT_EQ(moved[0].positions_m.floats().data(), before);
  EXPECT_EQ(moved[0].positions_m.At(1, 2), 6);
}

TEST(StatesTest, SeveralChunksAreOneAnswer) {
  std::vector<v1::StateChunk> chunks = {MakeChunk({1}, 3, Counting<float>(3, 0), {}),
                                        MakeChunk({2}, 3, Counting<float>(6, 10), {})};
  for (auto& chunk : chunks) chunk.set_frame(9);
  chunks[0].set_frames_dropped(4);
  const States states(std::move(chunks));
  ASSERT_EQ(states.size(), 2u);
  EXPECT_EQ(states[1].positions_m.At(1, 0), 13);
  EXPECT_EQ(states.frame(), 9u);
  EXPECT_EQ(states.frames_dropped(), 4u);
}

TEST(StatesTest, WhatDoesNotFitTogetherIsRefused) {
  const v1::StateChunk good = MakeChunk({2}, 1, Counting<float>(6, 0), {});
  const auto refused = [&good](auto&& spoil) {
    v1::StateChunk chunk = good;
    spoil(chunk);
    return ErrorOf([&chunk] { States({chunk}); }).reason == "MALFORMED_STATES";
  };
  EXPECT_TRUE(refused([](v1::StateChunk& chunk) { chunk.add_steps(1); }));
  EXPECT_TRUE(refused([](v1::StateChunk& chunk) { chunk.set_particle_counts(0, 3); }));
  EXPECT_TRUE(refused(
      [](v1::StateChunk& chunk) { chunk.mutable_positions_m()->mutable_data()->pop_back(); }));
  EXPECT_TRUE(refused([](v1::StateChunk& chunk) {
    chunk.mutable_positions_m()->set_data_type(v1::PackedArray::UINT32);
  }));
  EXPECT_TRUE(refused([](v1::StateChunk& chunk) { chunk.mutable_positions_m()->clear_shape(); }));
}

}  // namespace
}  // namespace drape
