#include "server/api/step_answer.h"

#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "tests/api/parsed_slices.h"

namespace drape::api {
namespace {

using google::protobuf::util::MessageDifferencer;
using test::Parsed;

constexpr uint32_t kRowCounts[] = {40, 7, 25};
constexpr uint32_t kRowTotal = 40 + 7 + 25;

// What `view` reads of three cloths, two of them away from the origin.
template <class T>
StateChunker Chunker(const ViewSpec& view, uint64_t max_bytes = UINT64_MAX) {
  const StateFields read = view.FieldsRead();
  std::vector<ChunkCloth> cloths;
  ClothStates states;
  uint32_t slot = 0;
  for (const uint32_t rows : kRowCounts) {
    const double x = 3.7 * slot;
    cloths.push_back({ClothId{slot++, 1},
                      {{x, 0, 0}, {0, x, -1e-3}},
                      view.fields.any() ? view.fields.RowsOf(rows) : 0,
                      read.RowsOf(rows)});
    states.cloths.push_back(
        {.completed_steps = 10 + rows, .time_s = 0.5 * rows, .fault = FaultReason::kNone});
  }
  std::vector<T> column(3 * kRowTotal);
  for (size_t k = 0; k < column.size(); ++k) column[k] = static_cast<T>(0.1 * static_cast<T>(k));
  if (read.positions) states.columns.positions_m = column;
  if (read.velocities) states.columns.velocities_m_per_s = column;
  return {std::move(cloths), std::move(states), max_bytes, view};
}

v1::StepResponse Acknowledgement(int reports) {
  v1::StepResponse answer;
  for (int k = 0; k < 3; ++k) {
    answer.add_cloth_ids(ClothId{static_cast<uint32_t>(k), 1}.Packed());
    answer.add_steps(50);
  }
  answer.mutable_timing()->set_encode_us(123);
  answer.mutable_grips()->add_slots(2);
  for (int k = 0; k < reports; ++k) answer.add_reports()->set_cloth_id(static_cast<uint64_t>(k));
  return answer;
}

std::vector<ViewSpec> Views() {
  const StateFields positions{.positions = true}, both{.positions = true, .velocities = true};
  std::vector<ViewSpec> views = {
      {.fields = positions}, {.fields = {.velocities = true}}, {.fields = both}};
  for (const auto encoding : {v1::StateView::FLOAT16, v1::StateView::FIXED16}) {
    views.push_back({.fields = both, .encoding = encoding});
  }
  views.push_back({.fields = {}, .reductions = {.centroid = true, .box = true}});
  views.push_back({.fields = both, .reductions = {.box = true}});
  views.push_back({.fields = {.positions = true, .particles = {0, 4, 6}},
                   .encoding = v1::StateView::FIXED16,
                   .reductions = {.centroid = true}});
  return views;
}

// The answer as protobuf has it: a message that holds its states.
TEST(StepAnswer, IsTheMessageThatHoldsItsStates) {
  int number = 0;
  for (const ViewSpec& view : Views()) {
    SCOPED_TRACE(number++);
    StateChunker chunker = Chunker<float>(view), same = Chunker<float>(view);
    v1::StepResponse expected = Acknowledgement(2);
    *expected.mutable_states() = test::NextChunk(same);
    StepAnswer answer(Acknowledgement(2), chunker.Next());
    EXPECT_EQ(answer.ByteSizeLong(),
              Acknowledgement(2).ByteSizeLong() + expected.states().ByteSizeLong());
    EXPECT_FALSE(answer.is_in_chunks());
    ASSERT_TRUE(answer.has_next());
    const auto found = Parsed<v1::StepResponse>(answer.Next());
    EXPECT_TRUE(MessageDifferencer::Equals(found, expected)) << found.DebugString();
    EXPECT_FALSE(answer.has_next());
  }
}

TEST(StepAnswer, WithoutStatesHasNone) {
  const auto found = Parsed<v1::StepResponse>(StepAnswer(Acknowledgement(0)).Next());
  EXPECT_FALSE(found.has_states());
  EXPECT_TRUE(MessageDifferencer::Equals(found, Acknowledgement(0)));
  EXPECT_EQ(ByteSize(StepAnswer(v1::StepResponse()).Next()), 0u);
  EXPECT_FALSE(StepAnswer().has_next());
}

// In chunks, each state message is what the chunker makes alone.
TEST(StepAnswer, InChunksIsOneAfterTheOther) {
  constexpr uint64_t kChunkBytes = 10 * 24;
  constexpr int kReports = 5000;
  for (const ViewSpec& view : Views()) {
    StateChunker same = Chunker<double>(view, kChunkBytes);
    StepAnswer answer(Acknowledgement(kReports), SharedChunks(Chunker<double>(view, kChunkBytes)),
                      1000);
    EXPECT_TRUE(answer.is_in_chunks());
    EXPECT_EQ(answer.ByteSizeLong(), Acknowledgement(kReports).ByteSizeLong() + 1000);
    v1::StepResponse expected = Acknowledgement(0);
    int reports = 0;
    while (answer.has_next()) {
      const auto part = Parsed<v1::StepResponse>(answer.Next());
      EXPECT_EQ(part.continues(), answer.has_next());
      EXPECT_EQ(part.has_states(), same.has_next());
      if (same.has_next()) {
        EXPECT_TRUE(MessageDifferencer::Equals(part.states(), test::NextChunk(same)));
      }
      v1::StepResponse rest = part;
      for (const auto& report : part.reports()) {
        EXPECT_EQ(report.cloth_id(), static_cast<uint64_t>(reports++));
      }
      rest.clear_reports();
      rest.clear_states();
      rest.clear_continues();
      EXPECT_TRUE(MessageDifferencer::Equals(rest, expected));
      expected.Clear();  // of the other messages
    }
    EXPECT_EQ(reports, kReports);
    EXPECT_FALSE(same.has_next());
  }
}

// Every row once, in order, in messages of bounded size, with nothing else to send or with reports.
TEST(StepAnswer, ContactsComeAPieceWithEachMessage) {
  constexpr int kContacts = 70'000;
  for (const int report_count : {0, 5000}) {
    v1::StepResponse whole = Acknowledgement(report_count);
    v1::ContactImpulses& contacts = *whole.mutable_contact_impulses();
    for (int row = 0; row < kContacts; ++row) {
      contacts.add_cloth_ids(7);
      contacts.add_particles(static_cast<uint32_t>(row));
      contacts.add_colliders(row % 3 - 1);
      for (int axis = 0; axis < 3; ++axis) contacts.add_impulses_n_s(3 * row + axis);
    }
    StepAnswer answer(whole, std::nullopt, 0);
    v1::StepResponse joined;
    while (answer.has_next()) {
      const auto part = Parsed<v1::StepResponse>(answer.Next());
      EXPECT_EQ(part.continues(), answer.has_next());
      EXPECT_LE(part.contact_impulses().particles_size(), 32'768);
      joined.MergeFrom(part);
    }
    joined.clear_continues();
    EXPECT_TRUE(MessageDifferencer::Equals(joined, whole));
  }
}

// A remembered answer takes no memory for its states besides that of the one that was sent.
TEST(StepAnswer, CopiesShareTheStates) {
  const ViewSpec view{.fields = {.positions = true}};
  StateChunker chunker = Chunker<float>(view);
  StepAnswer one(Acknowledgement(1), chunker.Next()), remembered = one;
  const MessageSlices sent = one.Next(), again = remembered.Next();
  EXPECT_EQ(sent.back().size(), kRowTotal * 12u);
  EXPECT_EQ(sent.back().begin(), again.back().begin());
  EXPECT_EQ(test::Joined(sent), test::Joined(again));

  StepAnswer first(Acknowledgement(1), SharedChunks(Chunker<float>(view, 10 * 12)), 1);
  StepAnswer second = first;
  std::vector<MessageSlices> all;
  while (first.has_next()) all.push_back(first.Next());
  EXPECT_GT(all.size(), 3u);
  for (const MessageSlices& message : all) {
    ASSERT_TRUE(second.has_next());
    const MessageSlices repeated = second.Next();
    EXPECT_EQ(message.back().begin(), repeated.back().begin());
    EXPECT_EQ(test::Joined(message), test::Joined(repeated));
  }
  EXPECT_FALSE(second.has_next());
}

}  // namespace
}  // namespace drape::api
