#include "server/api/parsed_size.h"

#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <string>

#include "drape/v1/simulation_service.pb.h"
#include "server/api/unparsed.h"
#include "tests/api/requests.h"

namespace drape::api {
namespace {

constexpr uint64_t kNeverEnough = std::numeric_limits<uint64_t>::max();

template <class Message>
uint64_t SizeOf(const std::string& bytes, uint64_t enough_bytes = kNeverEnough) {
  google::protobuf::io::ArrayInputStream stream(bytes.data(), static_cast<int>(bytes.size()));
  return ParsedSize_bytes(*Message::descriptor(), stream, enough_bytes);
}

// Never less than what the message takes.
template <class Message>
void ExpectEnough(const std::string& bytes) {
  Message message;
  ASSERT_TRUE(message.ParseFromString(bytes));
  EXPECT_GE(SizeOf<Message>(bytes), message.SpaceUsedLong());
}

std::string Repeated(const std::string& part, int count) {
  std::string all;
  for (int k = 0; k < count; ++k) all += part;
  return all;
}

TEST(ParsedSize, CoversPartsWithoutContent) {
  v1::CreateClothsRequest request;
  for (int k = 0; k < 1000; ++k) request.add_overrides();
  for (int k = 0; k < 500; ++k) request.mutable_spec()->mutable_environment()->add_colliders();
  ExpectEnough<v1::CreateClothsRequest>(request.SerializeAsString());
  EXPECT_GT(SizeOf<v1::CreateClothsRequest>(request.SerializeAsString()),
            20 * request.ByteSizeLong());
}

TEST(ParsedSize, CoversFieldsThatTheTypeDoesNotKnow) {
  // Field 4000: a number, bytes, a group with a number in it, an eight-byte and a four-byte number.
  const std::string varint("\x80\xfa\x01\x05", 4), text("\x82\xfa\x01\x02hi", 6);
  const std::string group("\x83\xfa\x01\x08\x05\x84\xfa\x01", 8);
  const std::string fixed64("\x81\xfa\x01\0\0\0\0\0\0\0\0", 11);
  const std::string fixed32("\x85\xfa\x01\0\0\0\0", 7);
  for (const std::string& part : {varint, text, group, fixed64, fixed32}) {
    ExpectEnough<v1::GetSessionRequest>(Repeated(part, 1000));
  }
}

// A number where a text or a list of doubles should be, and a text where a number should be.
TEST(ParsedSize, CoversKnownFieldsInFormsThatTheyDoNotHave) {
  ExpectEnough<v1::StepRequest>(Repeated("\x08\x05", 1000));
  ExpectEnough<v1::Pin>(Repeated("\x10\x05", 1000));
  ExpectEnough<v1::Pin>(Repeated(std::string("\x0a\0", 2), 1000));
}

TEST(ParsedSize, CoversTheFirstRoomOfLists) {
  v1::StepRequest request;
  request.add_cloth_ids(1);
  ExpectEnough<v1::StepRequest>(request.SerializeAsString());
  for (int k = 0; k < 64; ++k) {
    request.add_cloth_ids(1);
    ExpectEnough<v1::StepRequest>(request.SerializeAsString());
  }
}

TEST(ParsedSize, CoversNumbersThatArePacked) {
  v1::StepRequest request;
  for (int k = 0; k < 3000; ++k) request.add_cloth_ids(1);
  request.mutable_view()->set_positions(true);
  ExpectEnough<v1::StepRequest>(request.SerializeAsString());
}

TEST(ParsedSize, IsAboutTheSizeOfWhatIsMostlyNumbers) {
  v1::CreateClothsRequest request;
  request.set_session("sessions/one");
  *request.mutable_spec()->mutable_mesh()->mutable_positions_m() =
      test::Packed<float>(v1::PackedArray::FLOAT32, 3, std::vector<float>(3 * 100'000, 1.5F));
  const std::string bytes = request.SerializeAsString();
  ExpectEnough<v1::CreateClothsRequest>(bytes);
  EXPECT_LT(SizeOf<v1::CreateClothsRequest>(bytes), request.SpaceUsedLong() * 11 / 10);
}

TEST(ParsedSize, ReadsNoMoreThanItMust) {
  v1::CreateClothsRequest request;
  for (int k = 0; k < 100'000; ++k) request.add_overrides();
  const uint64_t size = SizeOf<v1::CreateClothsRequest>(request.SerializeAsString(), 50'000);
  EXPECT_GT(size, 50'000u);
  EXPECT_LT(size, 60'000u);
}

// Of a stream, whose requests are parsed in one place.
TEST(Unparsed, NothingIsKeptOfALargeRequest) {
  ByteBudget budget("FULL", {"most", kNeverEnough}, {"most", kNeverEnough}, 0);
  Unparsed<v1::StepRequest> request;
  const auto parse = [&](const v1::StepRequest& message, uint64_t most_bytes) {
    const grpc::Slice slice(message.SerializeAsString());
    request.bytes() = grpc::ByteBuffer(&slice, 1);
    return request.Parse(budget, "owner", most_bytes);
  };
  v1::StepRequest large;
  for (int k = 0; k < 100'000; ++k) large.mutable_resets()->add_overrides();
  ASSERT_TRUE(parse(large, kNeverEnough).ok());
  EXPECT_EQ(request.message().resets().overrides_size(), 100'000);
  EXPECT_GE(budget.used_bytes("owner"), request.message().SpaceUsedLong());
  const uint64_t large_bytes = request.message().SpaceUsedLong();
  EXPECT_EQ(parse(large, 1'000'000).reason(), "REQUEST_TOO_LARGE");
  EXPECT_EQ(budget.used_bytes(), 0u);
  EXPECT_LT(request.message().SpaceUsedLong(), large_bytes / 1000);
  ASSERT_TRUE(parse({}, kNeverEnough).ok());
  EXPECT_EQ(budget.used_bytes(), 0u);
}

// Whatever parses takes no more than it was told; whatever does not ends in time.
TEST(ParsedSize, CoversRandomBytes) {
  std::mt19937 random(1);
  v1::CreateClothsRequest request;
  request.set_session("sessions/one");
  *request.mutable_spec()->mutable_mesh() = test::SquareMesh();
  for (int k = 0; k < 5; ++k) request.mutable_spec()->add_pins()->set_particle(k);
  const std::string good = request.SerializeAsString();
  int parsed = 0;
  for (int k = 0; k < 20'000; ++k) {
    std::string bytes = good;
    for (int change = 0; change < 1 + k % 3; ++change) {
      bytes[random() % bytes.size()] = static_cast<char>(random());
    }
    const uint64_t size = SizeOf<v1::CreateClothsRequest>(bytes);
    v1::CreateClothsRequest message;
    if (!message.ParseFromString(bytes)) continue;
    ++parsed;
    ASSERT_GE(size, message.SpaceUsedLong()) << k;
  }
  EXPECT_GT(parsed, 1000);
}

}  // namespace
}  // namespace drape::api
