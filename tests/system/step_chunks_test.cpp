// Answers to steps in several messages: StepInChunks, and StepStream with in_chunks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"

namespace drape::test {
namespace {

constexpr size_t kChunkBytes = size_t{1} << 20;
// Ids and counts come beside the states of a chunk.
constexpr size_t kMostBytes = kChunkBytes + (size_t{64} << 10);

using Messages = std::vector<v1::StepResponse>;

struct StepChunksTest : testing::Test {
  // 300 x 300 particles with velocities are 2.2 MB: one cloth over several chunks.
  void SetUp() override {
    session_ = NewSession(*stub_);
    ids_ = Create(*stub_, HangingSheet(session_, 8, 40));
    ids_.push_back(Create(*stub_, HangingSheet(session_, 300))[0]);
  }

  v1::StepRequest Request(const Ids& ids) const {
    v1::StepRequest request = StepsOf(session_, ids, 2);
    request.mutable_view()->set_positions(true);
    request.mutable_view()->set_velocities(true);
    request.set_report(true);
    return request;
  }

  Answer<Messages> InChunks(const v1::StepRequest& request) {
    grpc::ClientContext context;
    const auto reader = stub_->StepInChunks(&context, request);
    Answer<Messages> answer;
    for (v1::StepResponse part; reader->Read(&part);) answer.value.push_back(std::move(part));
    answer.status = reader->Finish();
    return answer;
  }

  InProcessServer server_{"cpu"};
  std::unique_ptr<Stub> stub_ = server_.NewStub();
  std::string session_;
  Ids ids_;
};

// Positions and velocities in the order of the particles.
std::string BitsOf(const Messages& parts) {
  std::string positions, velocities;
  for (const v1::StepResponse& part : parts) {
    positions += part.states().positions_m().data();
    velocities += part.states().velocities_m_per_s().data();
  }
  return positions + velocities;
}

std::string BitsOf(const std::vector<v1::StateChunk>& chunks) {
  std::string positions, velocities;
  for (const v1::StateChunk& chunk : chunks) {
    positions += chunk.positions_m().data();
    velocities += chunk.velocities_m_per_s().data();
  }
  return positions + velocities;
}

void ExpectWhole(const Messages& parts, const Ids& ids) {
  ASSERT_GE(parts.size(), 3u);
  for (size_t k = 0; k < parts.size(); ++k) {
    EXPECT_EQ(parts[k].continues(), k + 1 < parts.size());
    EXPECT_LE(parts[k].ByteSizeLong(), kMostBytes);
    EXPECT_EQ(parts[k].states().is_last(), k + 1 == parts.size());
    EXPECT_EQ(parts[k].cloth_ids_size(), k == 0 ? static_cast<int>(ids.size()) : 0);
  }
  EXPECT_THAT(parts[0].cloth_ids(), testing::ElementsAreArray(ids));
  EXPECT_EQ(parts[0].reports_size(), static_cast<int>(ids.size()));
}

TEST_F(StepChunksTest, MessagesOfBoundedSizeHoldTheStatesAfterTheStep) {
  const auto answer = InChunks(Request(ids_));
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  ExpectWhole(answer.value, ids_);
  EXPECT_EQ(answer.value[0].steps(0), 2u);
  EXPECT_TRUE(BitsOf(answer.value) == BitsOf(Read(*stub_, session_, ids_)));
}

TEST_F(StepChunksTest, SmallAnswersAreOneMessage) {
  const auto answer = InChunks(Request({ids_[0], ids_[1]}));
  ASSERT_TRUE(answer.status.ok());
  ASSERT_EQ(answer.value.size(), 1u);
  EXPECT_FALSE(answer.value[0].continues());
  const auto empty = InChunks(StepsOf(session_, ids_, 1));
  ASSERT_EQ(empty.value.size(), 1u);
  EXPECT_FALSE(empty.value[0].has_states());
}

TEST_F(StepChunksTest, ManyReportsComeInSeveralMessages) {
  const Ids many = Create(*stub_, HangingSheet(session_, 2, 5000));
  v1::StepRequest request = StepsOf(session_, many, 1);
  request.set_report(true);
  const auto answer = InChunks(request);
  ASSERT_EQ(answer.value.size(), 3u);
  size_t k = 0;
  for (const v1::StepResponse& part : answer.value) {
    EXPECT_LE(part.ByteSizeLong(), kMostBytes);
    for (const v1::StepReport& report : part.reports()) EXPECT_EQ(report.cloth_id(), many[k++]);
  }
  EXPECT_EQ(k, many.size());
}

TEST_F(StepChunksTest, AStreamMixesBothKindsInOrder) {
  grpc::ClientContext context;
  const auto stream = stub_->StepStream(&context);
  v1::StepRequest whole = Request(ids_), chunked = Request(ids_);
  chunked.set_in_chunks(true);
  for (const auto& request : {chunked, whole, chunked, chunked}) {
    ASSERT_TRUE(stream->Write(request));
  }
  stream->WritesDone();
  std::vector<Messages> answers(1);
  for (v1::StepResponse part; stream->Read(&part);) {
    const bool continues = part.continues();
    answers.back().push_back(std::move(part));
    if (!continues) answers.emplace_back();
  }
  EXPECT_TRUE(stream->Finish().ok());
  answers.pop_back();
  ASSERT_EQ(answers.size(), 4u);
  for (size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(answers[k][0].steps(0), 2 * (k + 1));
    EXPECT_EQ(answers[k].size() == 1, k == 1);
    if (k != 1) ExpectWhole(answers[k], ids_);
  }
  EXPECT_TRUE(BitsOf(answers[3]) == BitsOf(Read(*stub_, session_, ids_)));
}

TEST_F(StepChunksTest, ARepetitionGetsTheSameMessages) {
  v1::StepRequest request = Request(ids_);
  request.set_request_id("a");
  const auto first = InChunks(request), again = InChunks(request);
  ASSERT_EQ(first.value.size(), again.value.size());
  for (size_t k = 0; k < first.value.size(); ++k) {
    EXPECT_TRUE(first.value[k].SerializeAsString() == again.value[k].SerializeAsString()) << k;
  }
  EXPECT_EQ(Get(*stub_, session_, ids_[0]).step(), 2u);
  EXPECT_THAT(FieldsOf(Call(*stub_, &Stub::Step, request).status),
              testing::ElementsAre("request_id"))
      << "one message is another answer";
}

TEST_F(StepChunksTest, AStepOfOneMessageCannotComeInChunks) {
  v1::StepRequest request = Request(ids_);
  request.set_in_chunks(true);
  EXPECT_THAT(FieldsOf(Call(*stub_, &Stub::Step, request).status),
              testing::ElementsAre("in_chunks"));
}

TEST_F(StepChunksTest, WhatIsRefusedHasNoMessage) {
  v1::StepRequest request = Request(ids_);
  request.set_expected_step(7);
  const auto answer = InChunks(request);
  EXPECT_EQ(ReasonOf(answer.status), "STEP_MISMATCH");
  EXPECT_TRUE(answer.value.empty());
}

}  // namespace
}  // namespace drape::test
