// What of expired sessions stays on the disk.
#include "server/checkpoints/expired_files.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "server/checkpoints/durable_file.h"

namespace drape {
namespace {

namespace fs = std::filesystem;

class ExpiredFilesTest : public testing::Test {
 protected:
  ExpiredFilesTest() { fs::remove_all(folder_); }
  ~ExpiredFilesTest() override { fs::remove_all(folder_); }

  // Sessions are called by numbers; each is older than those that were kept before. Its file.
  std::string Keep(const ExpiredFiles& files, const std::string& tenant, int session,
                   size_t bytes) {
    EXPECT_TRUE(files.Open().ok());
    const auto path = files.Keep(tenant, std::to_string(session), std::string(bytes, 'x'));
    if (!path.ok()) return path.status().reason();
    age_ += std::chrono::seconds(1);
    fs::last_write_time(*path, start_ + age_);
    return path->filename().string();
  }

  std::set<std::string> Names() const {
    std::set<std::string> names;
    for (const auto& file : fs::directory_iterator(folder_)) {
      names.insert(file.path().filename().string());
    }
    return names;
  }

  // WriteDurably on a disk that has this much room.
  ExpiredFiles::Writer OnADiskOf(uint64_t disk_bytes) {
    return [this, disk_bytes](const fs::path& path, std::string_view bytes) {
      uint64_t used = 0;
      for (const auto& file : fs::directory_iterator(folder_)) used += file.file_size();
      if (used + bytes.size() <= disk_bytes) return WriteDurably(path, bytes);
      return Status(StatusCode::kFailedPrecondition, "DISK_FULL", "no space left");
    };
  }

  const fs::path folder_ = fs::path(testing::TempDir()) / ("expired." + std::to_string(getpid()));
  const fs::file_time_type start_ = fs::file_time_type::clock::now();
  std::chrono::seconds age_{0};
};

TEST_F(ExpiredFilesTest, TheNewestOfATenantStayWithinItsBytes) {
  const ExpiredFiles files(folder_, 1000, WriteDurably);
  const std::string others = Keep(files, "bob", 0, 900);
  Keep(files, "alice", 1, 400);
  const std::string second = Keep(files, "alice", 2, 400);
  const std::string third = Keep(files, "alice", 3, 600);
  EXPECT_EQ(Names(), (std::set{others, second, third}));
  const std::string whole = Keep(files, "alice", 4, 1000);
  EXPECT_EQ(Names(), (std::set{others, whole}));
  EXPECT_EQ(Keep(files, "alice", 5, 1001), "EXPIRED_TOO_LARGE");
  EXPECT_EQ(Names(), (std::set{others, whole}));
}

TEST_F(ExpiredFilesTest, AFileThatTakesThePlaceOfItsOwnCountsOnce) {
  const ExpiredFiles files(folder_, 1000, WriteDurably);
  const std::string first = Keep(files, "alice", 1, 400);
  const std::string second = Keep(files, "alice", 2, 500);
  EXPECT_EQ(Keep(files, "alice", 2, 600), second);
  EXPECT_EQ(Names(), (std::set{first, second}));
}

TEST_F(ExpiredFilesTest, WhereTheDiskIsFullTheTenantsOldestMakeRoom) {
  const ExpiredFiles files(folder_, 10'000, OnADiskOf(2000));
  const std::string others = Keep(files, "bob", 0, 500);
  Keep(files, "alice", 1, 500);
  Keep(files, "alice", 2, 500);
  const std::string third = Keep(files, "alice", 3, 500);
  const std::string fourth = Keep(files, "alice", 4, 600);
  EXPECT_EQ(Names(), (std::set{others, third, fourth}));
  EXPECT_EQ(Keep(files, "alice", 5, 1501), "DISK_FULL");
  EXPECT_EQ(Names(), std::set{others}) << "never those of others";
}

TEST_F(ExpiredFilesTest, OtherErrorsOfTheDiskTakeNothingAway) {
  const std::string kept = Keep(ExpiredFiles(folder_, 1000, WriteDurably), "alice", 1, 500);
  const ExpiredFiles broken(folder_, 1000, [](const fs::path&, std::string_view) {
    return Status(StatusCode::kFailedPrecondition, "FILE_FAILED", "an input/output error");
  });
  EXPECT_EQ(Keep(broken, "alice", 2, 500), "FILE_FAILED");
  EXPECT_EQ(Names(), std::set{kept});
}

TEST_F(ExpiredFilesTest, WhatAKilledProcessWasWritingGoes) {
  const ExpiredFiles files(folder_, 1000, WriteDurably);
  const std::string kept = Keep(files, "alice", 1, 500);
  std::ofstream(folder_ / "0123-45.snapshot.draft") << "half";
  EXPECT_TRUE(files.Open().ok());
  EXPECT_EQ(Names(), std::set{kept});
}

}  // namespace
}  // namespace drape
