#include "server/gl/program_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <iterator>

#include "server/gl/buffer.h"
#include "server/gl/context.h"
#include "server/gl/program.h"
#include "server/gl/sync.h"

namespace drape::gl {
namespace {

namespace fs = std::filesystem;

class ProgramStoreTest : public testing::Test {
 protected:
  void SetUp() override {
    Result<std::unique_ptr<Context>> context = Context::Create({});
    ASSERT_TRUE(context.ok()) << context.status().ToString();
    context_ = std::move(context).value();
    fs::remove_all(folder_);
  }
  ~ProgramStoreTest() override { fs::remove_all(folder_); }

  std::vector<fs::path> Files() const {
    return {fs::directory_iterator(folder_), fs::directory_iterator()};
  }

  const fs::path folder_ =
      fs::path(testing::TempDir()) / ("drape_program_store_" + std::to_string(getpid()));

 private:
  std::unique_ptr<Context> context_;
};

ShaderSource Multiply(const std::string& factor) {
  return {"multiply.comp",
          "#version 450\nlayout(local_size_x = 4) in;\n"
          "layout(std430, binding = 3) buffer Values { uint values[]; };\n"
          "layout(location = 1) uniform uint more;\n"
          "void main() { values[gl_GlobalInvocationID.x] *= " +
              factor + "u * more; }\n",
          {}};
}

std::array<GLuint, 4> Products(const Program& program) {
  Result<Buffer> buffer = Buffer::Create(4 * sizeof(GLuint));
  std::array<GLuint, 4> values = {1, 2, 3, 4};
  buffer->Upload(0, std::as_bytes(std::span(values)));
  buffer->BindStorage(3);
  program.Use();
  program.SetUniform(1, 2);
  glDispatchCompute(1, 1, 1);
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  buffer->Download(0, std::as_writable_bytes(std::span(values)));
  return values;
}

TEST_F(ProgramStoreTest, ALoadedProgramDoesWhatTheCompiledOneDoes) {
  const auto store = ProgramStore::Open(folder_);
  ASSERT_NE(store, nullptr);
  const Result<Program> compiled = Program::Compile(Multiply("3"), store.get());
  ASSERT_TRUE(compiled.ok());
  ASSERT_EQ(Files().size(), 1u);
  const auto binary = store->Find(Multiply("3").text);
  ASSERT_TRUE(binary);
  EXPECT_FALSE(binary->bytes.empty());
  EXPECT_FALSE(store->Find(Multiply("4").text));
  EXPECT_EQ(Products(*compiled), (std::array<GLuint, 4>{6, 12, 18, 24}));

  const auto later = ProgramStore::Open(folder_);
  // What is loaded is the file's: another text's binary under this text's name.
  later->Keep(Multiply("3").text, Program::Compile(Multiply("5"), later.get())->binary());
  const Result<Program> loaded = Program::Compile(Multiply("3"), later.get());
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(Products(*loaded), (std::array<GLuint, 4>{10, 20, 30, 40}));
}

TEST_F(ProgramStoreTest, DamagedAndForeignFilesAreCompiledAgain) {
  const auto store = ProgramStore::Open(folder_);
  ASSERT_TRUE(Program::Compile(Multiply("3"), store.get()).ok());
  const fs::path path = Files().front();
  std::string good;
  {
    std::ifstream file(path, std::ios::binary);
    good.assign(std::istreambuf_iterator<char>(file), {});
  }
  std::vector<std::string> bad = {"", "short", good.substr(0, good.size() / 2), good + "x"};
  for (size_t at = 0; at < good.size(); at += good.size() / 40) {
    bad.push_back(good);
    bad.back()[at] = static_cast<char>(bad.back()[at] ^ 1);
  }
  for (const std::string& bytes : bad) {
    std::ofstream(path, std::ios::binary) << bytes;
    EXPECT_FALSE(store->Find(Multiply("3").text));
  }
  // A binary that the driver refuses.
  store->Keep(Multiply("3").text, {0x1234, {'n', 'o'}});
  const Result<Program> again = Program::Compile(Multiply("3"), store.get());
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(Products(*again), (std::array<GLuint, 4>{6, 12, 18, 24}));
  while (glGetError() != GL_NO_ERROR) continue;
}

TEST_F(ProgramStoreTest, WhatWasNotUsedForLongestGoes) {
  const auto store = ProgramStore::Open(folder_);
  const ProgramBinary binary{1, std::vector<char>(1000)};
  for (const char* text : {"a", "b", "c"}) store->Keep(text, binary);
  const auto before = fs::file_time_type::clock::now() - std::chrono::hours(1);
  for (const fs::path& path : Files()) fs::last_write_time(path, before);
  ASSERT_TRUE(store->Find("b"));  // which is a use
  const uint64_t size = fs::file_size(Files().front());
  const auto smaller = ProgramStore::Open(folder_, size + size / 2);
  EXPECT_EQ(Files().size(), 1u);
  EXPECT_TRUE(smaller->Find("b"));
}

TEST_F(ProgramStoreTest, AFolderThatCannotBeUsedIsNoError) {
  EXPECT_EQ(ProgramStore::Open(""), nullptr);
  EXPECT_EQ(ProgramStore::Open("/dev/null/folder"), nullptr);
  const auto store = ProgramStore::Open(folder_);
  fs::remove_all(folder_);
  EXPECT_TRUE(Program::Compile(Multiply("3"), store.get()).ok());
}

}  // namespace
}  // namespace drape::gl
