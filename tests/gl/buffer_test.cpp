#include "server/gl/buffer.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <vector>

#include "server/gl/context.h"

namespace drape::gl {
namespace {

constexpr size_t kMib = size_t{1} << 20;

std::vector<std::byte> Pattern(size_t size_bytes, uint32_t seed) {
  std::vector<std::byte> bytes(size_bytes);
  for (size_t k = 0; k < size_bytes; ++k) {
    bytes[k] = static_cast<std::byte>((k * 2654435769u + seed * 40503u) >> 13);
  }
  return bytes;
}

std::vector<std::byte> Contents(const Buffer& buffer) {
  std::vector<std::byte> bytes(buffer.size_bytes());
  buffer.Download(0, bytes);
  return bytes;
}

class BufferTest : public ::testing::Test {
 protected:
  const std::unique_ptr<Context> context_ = std::move(Context::Create({}).value());
};

// The memory that uploads pass through is smaller, and most of these begin within it.
TEST_F(BufferTest, UploadsOfAnySizeArrive) {
  Buffer buffer = std::move(Buffer::Create(11 * kMib).value());
  std::vector<std::byte> expected(11 * kMib);
  buffer.Upload(0, expected);
  size_t offset = 0;
  uint32_t seed = 0;
  for (const size_t size : {size_t{1}, size_t{4}, size_t{7}, kMib - 12, kMib, kMib + 1, 5 * kMib,
                            size_t{3}, 2 * kMib}) {
    const std::vector<std::byte> bytes = Pattern(size, ++seed);
    buffer.Upload(offset, bytes);
    std::memcpy(expected.data() + offset, bytes.data(), size);
    offset += size;
  }
  EXPECT_EQ(Contents(buffer), expected);
}

// A copy on the device sees what was uploaded before it and nothing of what came later. NVIDIA's
// driver breaks this for glNamedBufferSubData (server/gl/drivers.md).
TEST_F(BufferTest, UploadsKeepTheirPlaceAmongTheCommandsOfTheDevice) {
  constexpr size_t kBytes = kMib / 2;
  constexpr uint32_t kRounds = 40;
  Buffer buffer = std::move(Buffer::Create(kBytes).value());
  Buffer copies = std::move(Buffer::Create(kRounds * kBytes).value());
  for (uint32_t round = 0; round < kRounds; ++round) {
    buffer.Upload(0, Pattern(kBytes, round));
    copies.CopyFrom(buffer, 0, round * kBytes, kBytes);
  }
  const std::vector<std::byte> all = Contents(copies);
  for (uint32_t round = 0; round < kRounds; ++round) {
    const std::vector<std::byte> expected = Pattern(kBytes, round);
    EXPECT_TRUE(std::equal(expected.begin(), expected.end(), all.begin() + round * kBytes))
        << "round " << round;
  }
}

// Each context has memory of its own for uploads, also where both are of one thread.
TEST_F(BufferTest, UploadsGoThroughTheCurrentContext) {
  const std::vector<std::byte> first = Pattern(kMib, 1), second = Pattern(kMib, 2);
  Buffer buffer = std::move(Buffer::Create(kMib).value());
  buffer.Upload(0, first);
  {
    const std::unique_ptr<Context> other = std::move(Context::Create({}).value());
    Buffer of_other = std::move(Buffer::Create(kMib).value());
    of_other.Upload(0, second);
    EXPECT_EQ(Contents(of_other), second);
  }
  context_->MakeCurrent();
  EXPECT_EQ(Contents(buffer), first);
  buffer.Upload(0, second);
  EXPECT_EQ(Contents(buffer), second);
}

}  // namespace
}  // namespace drape::gl
