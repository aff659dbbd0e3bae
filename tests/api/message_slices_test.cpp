#include "server/api/message_slices.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drape/v1/state.pb.h"
#include "tests/api/parsed_slices.h"

namespace drape::api {
namespace {

// gRPC copies slices of a few bytes.
constexpr size_t kLong = 1000;

TEST(MessageSlices, ASliceIsWhereItsOwnerHasTheBytesAndKeepsThem) {
  auto owner = std::make_shared<std::vector<std::byte>>(kLong, std::byte{7});
  const std::weak_ptr<const void> alive = owner;
  const std::byte* const begin = owner->data();
  std::optional<grpc::Slice> slice = SliceOf(owner, *owner);
  owner = nullptr;
  std::optional<grpc::Slice> part = slice->sub(100, 200);
  slice.reset();
  EXPECT_EQ(part->size(), 100u);
  EXPECT_EQ(reinterpret_cast<const std::byte*>(part->begin()), begin + 100);
  EXPECT_FALSE(alive.expired());
  part.reset();
  EXPECT_TRUE(alive.expired());
}

TEST(MessageSlices, ABufferSharesThem) {
  const MessageSlices message = {SliceOf(std::string(kLong, 'a')), grpc::Slice("b")};
  EXPECT_EQ(ByteSize(message), kLong + 1);
  const grpc::ByteBuffer buffer = ToByteBuffer(message);
  EXPECT_EQ(buffer.Length(), kLong + 1);
  std::vector<grpc::Slice> found;
  ASSERT_TRUE(buffer.Dump(&found).ok());
  EXPECT_EQ(found.front().begin(), message.front().begin());
}

// A field of which the length takes one byte, two or four.
TEST(MessageSlices, AMessageOfFieldsAndSlices) {
  for (const size_t bytes : {size_t{0}, size_t{24}, size_t{127}, size_t{128}, size_t{3} << 20}) {
    SCOPED_TRACE(bytes);
    const std::string data(bytes, 'x');
    v1::PackedArray array;
    array.set_data_type(v1::PackedArray::INT16);
    array.add_shape(5);
    v1::StateChunk chunk;
    chunk.add_cloth_ids(3);
    constexpr int kData = v1::PackedArray::kDataFieldNumber;
    constexpr int kPositions = v1::StateChunk::kPositionsMFieldNumber;
    MessageWriter writer;
    writer.BeginField(kPositions, MessageWriter::FieldBytes(kData, bytes) + array.ByteSizeLong());
    writer.AppendFields(array);
    writer.BeginField(kData, bytes);
    writer.Append(SliceOf(data));
    writer.AppendFields(chunk);
    const MessageSlices slices = std::move(writer).Finish();
    v1::StateChunk found;
    ASSERT_TRUE(found.ParseFromString(test::Joined(slices)));
    EXPECT_EQ(found.positions_m().data(), data);
    EXPECT_EQ(found.positions_m().data_type(), v1::PackedArray::INT16);
    EXPECT_EQ(found.positions_m().shape(0), 5u);
    EXPECT_EQ(found.cloth_ids(0), 3u);
    EXPECT_EQ(ByteSize(slices),
              MessageWriter::FieldBytes(
                  kPositions, MessageWriter::FieldBytes(kData, bytes) + array.ByteSizeLong()) +
                  chunk.ByteSizeLong());
  }
}

}  // namespace
}  // namespace drape::api
