// The files of the writers, read back by readers of this file's own.
#include "client/cli/state_writers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zip.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <sstream>

#include "tests/client/state_file_test_support.h"

namespace drape::cli {
namespace {

using client_test::ErrorOf;
using client_test::kThird;
using client_test::Lines;
using client_test::MakeStates;
using client_test::ReadText;
using client_test::TwoCloths;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

using StateWritersTest = client_test::StateFileTest;

TEST_F(StateWritersTest, CsvHasTheContractsColumnsAndOneRowPerParticle) {
  const auto lines = Lines(ReadText(Written("s.csv")));
  ASSERT_EQ(lines.size(), 1u + 2 * 5);
  EXPECT_EQ(lines[0], "time_s,cloth,particle,x_m,y_m,z_m,vx_m_per_s,vy_m_per_s,vz_m_per_s");
  EXPECT_EQ(lines[1], "0.1,0,0,1,2,3,0.5,0.5,0.5");
  EXPECT_EQ(lines[2], "0.1,0,1,4,0.333333343,6,0.5,0.5,0.5");
  EXPECT_EQ(lines[5], "0.1,1,1,13,14,15,0.5,0.5,-9.99999968e-21");
  EXPECT_THAT(lines[10], StartsWith("0.2,1,1,"));
}

TEST_F(StateWritersTest, CsvNumbersGiveBackTheSameBits) {
  const double third = 1.0 / 3;
  const std::vector<double> positions = {third, -2 * third, 1e-300};
  const auto writer = MakeCsvWriter(folder_ / "d.csv", {});
  writer->Add(MakeStates<double>({1}, 3, positions, {0.1, 0.2, 0.3}));
  writer->Finish();
  std::istringstream row(Lines(ReadText(folder_ / "d.csv")).at(1));
  std::vector<double> numbers;
  for (std::string cell; std::getline(row, cell, ',');) numbers.push_back(std::stod(cell));
  EXPECT_THAT(numbers, ElementsAre(0.1 * 3, 0, 0, third, -2 * third, 1e-300, 0.1, 0.2, 0.3));
}

// An array of an NPZ file.
struct NpyArray {
  std::string type;
  std::string shape;
  std::string bytes;

  template <class Number>
  Number At(size_t index) const {
    Number number;
    std::memcpy(&number, bytes.data() + index * sizeof(Number), sizeof(Number));
    return number;
  }
};

// The text between `before` and `after`.
std::string Between(const std::string& text, const std::string& before, const std::string& after) {
  const size_t begin = text.find(before) + before.size();
  return text.substr(begin, text.find(after, begin) - begin);
}

NpyArray ReadNpy(const std::filesystem::path& path, const std::string& name) {
  int error = 0;
  const std::unique_ptr<zip_t, void (*)(zip_t*)> archive(
      zip_open(path.c_str(), ZIP_RDONLY | ZIP_CHECKCONS, &error), zip_discard);
  EXPECT_NE(archive, nullptr) << error;
  zip_stat_t stat;
  EXPECT_EQ(zip_stat(archive.get(), (name + ".npy").c_str(), 0, &stat), 0) << name;
  std::string text(stat.size, '\0');
  zip_file_t* file = zip_fopen(archive.get(), (name + ".npy").c_str(), 0);
  EXPECT_EQ(zip_fread(file, text.data(), stat.size), static_cast<zip_int64_t>(stat.size));
  zip_fclose(file);

  EXPECT_EQ(text.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
  const size_t header_bytes =
      static_cast<unsigned char>(text[8]) + 256u * static_cast<unsigned char>(text[9]);
  EXPECT_EQ((10 + header_bytes) % 64, 0u);
  const std::string header = text.substr(10, header_bytes);
  EXPECT_EQ(header.back(), '\n');
  EXPECT_THAT(header, HasSubstr("'fortran_order': False"));
  return {Between(header, "'descr': '", "'"), Between(header, "'shape': (", ")"),
          text.substr(10 + header_bytes)};
}

TEST_F(StateWritersTest, NpzHoldsEverySample) {
  const auto path = Written("s.npz");
  const NpyArray times = ReadNpy(path, "times");
  EXPECT_EQ(times.type, "<f8");
  EXPECT_EQ(times.shape, "2,");
  EXPECT_EQ(times.At<double>(1), 0.2);
  const NpyArray steps = ReadNpy(path, "steps");
  EXPECT_EQ(steps.At<uint64_t>(1), 2u);
  const NpyArray positions = ReadNpy(path, "positions");
  EXPECT_EQ(positions.type, "<f4");
  EXPECT_EQ(positions.shape, "2,5,3,");
  ASSERT_EQ(positions.bytes.size(), 2u * 5 * 3 * 4);
  EXPECT_EQ(positions.At<float>(4), kThird);
  EXPECT_EQ(positions.At<float>(15), 2);
  const NpyArray velocities = ReadNpy(path, "velocities");
  EXPECT_EQ(velocities.shape, "2,5,3,");
  EXPECT_EQ(velocities.At<float>(29), -1e-20f);
  const NpyArray cloth = ReadNpy(path, "cloth");
  EXPECT_EQ(cloth.type, "<u4");
  EXPECT_EQ(cloth.shape, "5,");
  EXPECT_EQ(cloth.At<uint32_t>(3), 1u);
  EXPECT_EQ(ReadNpy(path, "particle").At<uint32_t>(4), 1u);
}

TEST_F(StateWritersTest, RowsAreNamedByTheParticlesThatTheyAre) {
  StateFileOptions options;
  options.particles = {4, 17};
  for (const char* name : {"p.csv", "p.npz"}) {
    const auto writer = MakeStateWriter(folder_ / name, options);
    writer->Add(MakeStates<float>({2, 2}, 1, std::vector<float>(12, 7), std::vector<float>(12, 8)));
    writer->Finish();
  }
  const auto lines = Lines(ReadText(folder_ / "p.csv"));
  EXPECT_EQ(lines.at(1), "0.1,0,4,7,7,7,8,8,8");
  EXPECT_EQ(lines.at(4), "0.1,1,17,7,7,7,8,8,8");
  const NpyArray particle = ReadNpy(folder_ / "p.npz", "particle");
  EXPECT_EQ(particle.At<uint32_t>(0), 4u);
  EXPECT_EQ(particle.At<uint32_t>(3), 17u);
}

// A cloth that stopped with a fault at step 1 still belongs to the sample at step 7.
TEST_F(StateWritersTest, TheTimeIsThatOfTheSample) {
  for (const char* name : {"s.csv", "s.npz"}) {
    const auto writer = MakeStateWriter(folder_ / name, {});
    writer->Add(TwoCloths(1), SampleTime{7, 0.35});
    writer->Finish();
  }
  EXPECT_THAT(Lines(ReadText(folder_ / "s.csv")).at(5), StartsWith("0.35,1,1,"));
  EXPECT_EQ(ReadNpy(folder_ / "s.npz", "times").At<double>(0), 0.35);
  EXPECT_EQ(ReadNpy(folder_ / "s.npz", "steps").At<uint64_t>(0), 7u);
}

TEST_F(StateWritersTest, NpzWithoutSamplesIsStillOne) {
  MakeNpzWriter(folder_ / "none.npz", {})->Finish();
  EXPECT_EQ(ReadNpy(folder_ / "none.npz", "positions").shape, "0,0,3,");
}

TEST_F(StateWritersTest, APathThatCannotBeWrittenFailsAtOnce) {
  for (const char* name :
       {"no/s.csv", "no/s.npz", "no/s.obj", "no/s.pc2", "no/s.ply", "no/s.usda"}) {
    const ErrorDetails details = ErrorOf([&] { MakeStateWriter(folder_ / name, {}); });
    EXPECT_EQ(details.reason, "CANNOT_WRITE");
    EXPECT_THAT(details.message, HasSubstr(name));
  }
}

TEST_F(StateWritersTest, AnUnfinishedFileGoesAwayAndAnOlderOneStays) {
  MakeCsvWriter(folder_ / "cut.csv", {})->Add(TwoCloths(1));
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
  for (const char* name : {"s.csv", "s.npz", "s.obj", "s.pc2", "s.ply", "s.usda"}) {
    client_test::WriteText(folder_ / name, "older");
    MakeStateWriter(folder_ / name, {})->Add(TwoCloths(1));
    EXPECT_EQ(ReadText(folder_ / name), "older");
    std::filesystem::remove(folder_ / name);
    EXPECT_TRUE(std::filesystem::is_empty(folder_.path())) << name;
  }
}

TEST_F(StateWritersTest, WritesThroughALink) {
  client_test::WriteText(folder_ / "file.csv", "older");
  std::filesystem::create_symlink("file.csv", folder_ / "link.csv");
  MakeCsvWriter(folder_ / "link.csv", {})->Finish();
  EXPECT_TRUE(std::filesystem::is_symlink(folder_ / "link.csv"));
  EXPECT_THAT(ReadText(folder_ / "file.csv"), StartsWith("time_s,"));
}

// /dev/full takes what is written and fails when it is to arrive.
TEST_F(StateWritersTest, AFullDiskIsAnError) {
  std::filesystem::create_symlink("/dev/full", folder_ / "full.csv");
  std::filesystem::create_symlink("/dev/full", folder_ / "full.pc2");
  std::filesystem::create_symlink("/dev/full", folder_ / "full.usda");
  for (const char* name : {"full.csv", "full.pc2", "full.usda"}) {
    const ErrorDetails details = ErrorOf([&] {
      const auto writer = MakeStateWriter(folder_ / name, {});
      writer->Add(TwoCloths(1));
      writer->Finish();
    });
    EXPECT_EQ(details.reason, "CANNOT_WRITE") << name;
    EXPECT_THAT(details.message, HasSubstr("No space left")) << name;
  }
}

TEST(IsStateFileTest, GoesByExtension) {
  for (const char* name : {"a.csv", "b/c.npz", "a.b.obj", "a.ply", "a.pc2", "a.usda"}) {
    EXPECT_TRUE(IsStateFile(name)) << name;
  }
  for (const char* name : {"a", "a.txt", "csv", ".csv/a", "a.usd"}) EXPECT_FALSE(IsStateFile(name));
}

TEST(TopologyTest, GridsHaveTwoTrianglesPerCellSeenFromAbove) {
  v1::ClothSpec spec;
  spec.mutable_grid()->set_columns(3);
  spec.mutable_grid()->set_rows(2);
  const Topology topology = TopologyOf(spec);
  using T = std::array<uint32_t, 3>;
  EXPECT_THAT(topology.triangles, ElementsAre(T{0, 3, 1}, T{1, 3, 4}, T{1, 4, 2}, T{2, 4, 5}));
  EXPECT_TRUE(topology.lines.empty());
}

TEST(TopologyTest, RowsAndParticlesHaveLines) {
  using L = std::array<uint32_t, 2>;
  v1::ClothSpec row;
  row.mutable_grid()->set_columns(1);
  row.mutable_grid()->set_rows(3);
  EXPECT_THAT(TopologyOf(row).lines, ElementsAre(L{0, 1}, L{1, 2}));
  v1::ClothSpec particles;
  auto* constraint = particles.mutable_particles()->add_distance_constraints();
  constraint->set_i(4);
  constraint->set_j(2);
  EXPECT_THAT(TopologyOf(particles).lines, ElementsAre(L{4, 2}));
}

}  // namespace
}  // namespace drape::cli
