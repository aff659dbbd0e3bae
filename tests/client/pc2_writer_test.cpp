// PC2 read back by a reader written from the description of the format.
#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "client/cli/state_writers.h"
#include "tests/client/state_file_test_support.h"

namespace drape::cli {
namespace {

using client_test::kThird;
using client_test::MakeStates;
using client_test::ReadText;
using client_test::TwoCloths;
using ::testing::ElementsAre;

using Pc2WriterTest = client_test::StateFileTest;

struct PointCache {
  int32_t version = 0;
  int32_t point_count = 0;
  float start = 0;
  float sampling = 0;
  int32_t sample_count = 0;
  std::vector<float> elements;  // [sample_count][point_count][3]
};

template <class Number>
Number At(const std::string& bytes, size_t offset) {
  Number number;
  std::memcpy(&number, bytes.data() + offset, sizeof(Number));
  return number;
}

PointCache ReadPc2(const std::filesystem::path& path) {
  const std::string bytes = ReadText(path);
  EXPECT_GE(bytes.size(), 32u);
  EXPECT_EQ(bytes.substr(0, 12), std::string("POINTCACHE2\0", 12));
  PointCache cache{At<int32_t>(bytes, 12), At<int32_t>(bytes, 16), At<float>(bytes, 20),
                   At<float>(bytes, 24),   At<int32_t>(bytes, 28), {}};
  const auto points =
      static_cast<size_t>(cache.point_count) * static_cast<size_t>(cache.sample_count);
  EXPECT_EQ(bytes.size(), 32 + points * 12) << "no more and no less than the header says";
  for (size_t offset = 32; offset + 4 <= bytes.size(); offset += 4) {
    cache.elements.push_back(At<float>(bytes, offset));
  }
  return cache;
}

TEST_F(Pc2WriterTest, HoldsAllClothsOfEverySample) {
  const PointCache cache = ReadPc2(Written("s.pc2"));
  EXPECT_EQ(cache.version, 1);
  EXPECT_EQ(cache.point_count, 5);
  EXPECT_EQ(cache.start, 1);
  EXPECT_EQ(cache.sampling, 1);
  EXPECT_EQ(cache.sample_count, 2);
  EXPECT_THAT(cache.elements,
              ElementsAre(1, 2, 3, 4, kThird, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15,  //
                          2, 3, 4, 5, kThird, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16));
}

// Steps 20, 40 and the last, 50.
TEST_F(Pc2WriterTest, StartAndSamplingAreInSteps) {
  const auto writer = MakePc2Writer(folder_ / "s.pc2");
  for (const uint64_t step : {20, 40, 50}) writer->Add(TwoCloths(1), SampleTime{step, 0.1});
  writer->Finish();
  const PointCache cache = ReadPc2(folder_ / "s.pc2");
  EXPECT_EQ(cache.start, 20);
  EXPECT_EQ(cache.sampling, 20);
  EXPECT_EQ(cache.sample_count, 3);
}

TEST_F(Pc2WriterTest, DoublesAreRounded) {
  const auto writer = MakePc2Writer(folder_ / "d.pc2");
  writer->Add(MakeStates<double>({1}, 3, {1.0 / 3, -1e300, 16777217}, {}));
  writer->Finish();
  EXPECT_THAT(ReadPc2(folder_ / "d.pc2").elements,
              ElementsAre(kThird, std::numeric_limits<float>::lowest(), 16777216));
}

TEST_F(Pc2WriterTest, WithoutSamplesItIsStillOne) {
  MakePc2Writer(folder_ / "none.pc2")->Finish();
  EXPECT_EQ(ReadPc2(folder_ / "none.pc2").sample_count, 0);
}

}  // namespace
}  // namespace drape::cli
