#include "server/solver/gl_compute/scratch_pool.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "server/gl/context.h"
#include "server/solver/step_report.h"
#include "tests/gl_compute/test_cloths.h"

namespace drape {
namespace {

using testing::HasSubstr;

class ScratchPoolTest : public testing::Test {
 protected:
  void SetUp() override {
    Result<std::unique_ptr<gl::Context>> context = gl::Context::Create({});
    ASSERT_TRUE(context.ok()) << context.status().ToString();
    context_ = std::move(context).value();
  }

 private:
  std::unique_ptr<gl::Context> context_;
};

TEST_F(ScratchPoolTest, AnArrayIsBegunOnceNoOtherHasRoom) {
  Result<ScratchPool> pool = ScratchPool::Create(4096);  // 1024 words
  ASSERT_TRUE(pool.ok());
  std::vector<ScratchRange> ranges;
  for (const uint32_t array : {0u, 1u, 0u}) {
    Result<ScratchRange> range = pool->Allocate(array == 1 ? 608 : 512);
    ASSERT_TRUE(range.ok());
    EXPECT_EQ(range->array(), array);
    ranges.push_back(std::move(range).value());
  }
  EXPECT_EQ(pool->array_count(), 2u);
  EXPECT_EQ(ranges[2].begin(), 512u);
  EXPECT_LE(pool->buffer(1).size_bytes(), 4096u);
  // Room that is given back is used again.
  ranges.erase(ranges.begin());
  const Result<ScratchRange> again = pool->Allocate(500);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->array(), 0u);
  EXPECT_EQ(pool->array_count(), 2u);
}

TEST_F(ScratchPoolTest, WhatNoArrayCanHoldIsRefusedAndChangesNothing) {
  Result<ScratchPool> pool = ScratchPool::Create(4096);
  ASSERT_TRUE(pool.ok());
  const Result<ScratchRange> most = pool->Allocate(1024);
  ASSERT_TRUE(most.ok());
  const Result<ScratchRange> too_much = pool->Allocate(1025);
  ASSERT_FALSE(too_much.ok());
  EXPECT_EQ(too_much.status().reason(), "DEVICE_MEMORY");
  EXPECT_THAT(too_much.status().message(), HasSubstr("\"scratch\""));
  EXPECT_EQ(pool->array_count(), 1u);
}

// Resident and tiled cloths in the order 0, 1, 0, 1, ... so that neighbours in a batch have scratch
// memory in different arrays.
std::vector<ClothHandle> CreateCloths(Backend& backend) {
  const ClothParameters parameters = test::PlainParameters();
  const auto resident = GridModel(20, 20, {0});
  const auto tiled = GridModel(41, 26, {0});
  std::vector<ClothHandle> cloths;
  for (int k = 0; k < 16; ++k) {
    const auto& model = k % 4 == 3 ? tiled : resident;
    ParticleState state = AtRest(*model);
    for (Eigen::Vector3d& position : state.positions_m) position.x() += 0.01 * k;
    cloths.push_back(CreateCloth(backend, model, parameters, state));
  }
  return cloths;
}

std::vector<double> Figures(const StepReport& report) {
  const Measurements& measured = report.measured;
  return {measured.max_strain,        measured.strain_p99,
          measured.rms_motion_m,      measured.kinetic_energy_j,
          measured.lowest_m,          static_cast<double>(measured.contacts),
          measured.max_penetration_m, measured.max_residual_m};
}

TEST(ScratchArraysTest, TheArrayOfAClothChangesNoBit) {
  const std::unique_ptr<Backend> whole = MakeGlBackend();
  const std::unique_ptr<Backend> split = MakeGlBackend({.max_array_bytes = 512 * 1024});
  const std::vector<ClothHandle> in_one = CreateCloths(*whole), in_many = CreateCloths(*split);
  for (int step = 0; step < 2; ++step) {
    std::vector<StepItem> items_of_one, items_of_many;
    for (size_t k = 0; k < in_one.size(); ++k) {
      items_of_one.push_back({.cloth = in_one[k], .pin_targets_m = {}, .measure = k % 3 != 0});
      items_of_many.push_back({.cloth = in_many[k], .pin_targets_m = {}, .measure = k % 3 != 0});
    }
    const BatchReport one = whole->Step(items_of_one), many = split->Step(items_of_many);
    EXPECT_GT(many.dispatch_count, one.dispatch_count);  // there are several arrays
    for (size_t k = 0; k < in_one.size(); ++k) {
      EXPECT_EQ(one.reports[k].fault, FaultReason::kNone);
      EXPECT_EQ(Figures(one.reports[k]), Figures(many.reports[k])) << "cloth " << k;
      ASSERT_EQ(ReadCloth(*whole, in_one[k]), ReadCloth(*split, in_many[k])) << "cloth " << k;
    }
  }
}

}  // namespace
}  // namespace drape
