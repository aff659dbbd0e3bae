// States of some particles of every cloth, by every call that answers with states.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstring>
#include <map>

#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"

namespace drape::test {
namespace {

using List = std::vector<uint32_t>;
// The received rows of each cloth.
using Rows = std::map<uint64_t, std::vector<std::array<float, 3>>>;

// 3 rows of positions and velocities fit into a chunk, 6 of one of them.
constexpr uint32_t kMaxChunkBytes = 3 * 24 + 5;
constexpr uint64_t kMaxStepStateBytes = 400;

api::RequestLimits SmallLimits() {
  api::RequestLimits limits;
  limits.max_chunk_bytes = kMaxChunkBytes;
  limits.max_step_state_bytes = kMaxStepStateBytes;
  return limits;
}

void AddRows(const v1::StateChunk& chunk, const v1::PackedArray& column, Rows& rows) {
  const char* next = column.data().data();
  for (int k = 0; k < chunk.cloth_ids_size(); ++k) {
    auto& of_cloth = rows[chunk.cloth_ids(k)];
    EXPECT_EQ(chunk.first_particles(k), of_cloth.size());
    for (uint32_t row = 0; row < chunk.particle_counts(k); ++row, next += 12) {
      std::memcpy(of_cloth.emplace_back().data(), next, 12);
    }
  }
  EXPECT_EQ(next, column.data().data() + column.data().size());
}

struct Received {
  Rows positions, velocities;
  size_t chunks = 0;

  void Add(const v1::StateChunk& chunk) {
    ++chunks;
    if (chunk.has_positions_m()) AddRows(chunk, chunk.positions_m(), positions);
    if (chunk.has_velocities_m_per_s()) AddRows(chunk, chunk.velocities_m_per_s(), velocities);
  }
};

Rows Selected(const Rows& whole, const List& particles) {
  Rows selected;
  for (const auto& [id, rows] : whole) {
    for (const uint32_t particle : particles) selected[id].push_back(rows.at(particle));
  }
  return selected;
}

void SetView(const List& particles, bool velocities, v1::StateView* view) {
  view->set_positions(true);
  view->set_velocities(velocities);
  view->mutable_particles()->Assign(particles.begin(), particles.end());
}

class ParticleStates : public testing::Test {
 protected:
  // Three cloths of 64, 16 and 64 particles.
  ParticleStates() {
    for (const uint32_t side : {8u, 4u, 8u}) {
      ids_.push_back(Create(*stub_, HangingSheet(session_, side))[0]);
    }
    Step(*stub_, StepsOf(session_, {ids_[0]}, 3));
    Step(*stub_, StepsOf(session_, ids_, 5));
  }

  Received Whole(const Ids& ids) {
    Received whole;
    for (const v1::StateChunk& chunk : Read(*stub_, session_, ids)) whole.Add(chunk);
    return whole;
  }

  grpc::Status ReadParticles(const List& particles, bool velocities, Received& received) {
    v1::ReadStatesRequest request;
    request.set_session(session_);
    request.set_all_cloths(true);
    SetView(particles, velocities, request.mutable_view());
    grpc::ClientContext context;
    const auto reader = stub_->ReadStates(&context, request);
    v1::StateChunk chunk;
    bool is_last = false;
    while (reader->Read(&chunk)) {
      EXPECT_FALSE(is_last);
      is_last = chunk.is_last();
      EXPECT_LE(chunk.positions_m().data().size() + chunk.velocities_m_per_s().data().size(),
                kMaxChunkBytes);
      received.Add(chunk);
    }
    const grpc::Status status = reader->Finish();
    EXPECT_EQ(is_last, status.ok());
    return status;
  }

  v1::StepRequest OneStep(const Ids& ids, const List& particles, bool velocities) const {
    v1::StepRequest request = StepsOf(session_, ids, 1);
    SetView(particles, velocities, request.mutable_view());
    return request;
  }

  v1::StreamStatesRequest Subscription(const List& particles, uint32_t initial_credit) const {
    v1::StreamStatesRequest request;
    request.mutable_subscribe()->set_session(session_);
    request.mutable_subscribe()->set_all_cloths(true);
    request.mutable_subscribe()->set_initial_credit(initial_credit);
    SetView(particles, true, request.mutable_subscribe()->mutable_view());
    return request;
  }

  InProcessServer server_{"cpu", {}, SmallLimits()};
  std::unique_ptr<Stub> stub_ = server_.NewStub();
  std::string session_ = NewSession(*stub_);
  Ids ids_;
};

TEST_F(ParticleStates, AStepAnswersWithTheRowsThatAreAskedFor) {
  const List particles{0, 9, 10, 15};
  const v1::StepResponse response = Step(*stub_, OneStep({ids_[1], ids_[0]}, particles, true));
  Received received;
  received.Add(response.states());
  EXPECT_THAT(response.states().cloth_ids(), testing::ElementsAre(ids_[1], ids_[0]));
  EXPECT_THAT(response.states().particle_counts(), testing::ElementsAre(4, 4));
  EXPECT_THAT(response.states().positions_m().shape(), testing::ElementsAre(8, 3));
  EXPECT_THAT(response.states().steps(), testing::ElementsAre(6, 9));
  const Received whole = Whole({ids_[0], ids_[1]});
  EXPECT_EQ(received.positions, Selected(whole.positions, particles));
  EXPECT_EQ(received.velocities, Selected(whole.velocities, particles));
}

// 2 x 64 particles are 1536 bytes.
TEST_F(ParticleStates, OnlyWhatIsAskedForCountsAgainstTheLimitOfAStepAnswer) {
  List particles(16);
  for (uint32_t k = 0; k < 16; ++k) particles[k] = 4 * k;
  EXPECT_EQ(Step(*stub_, OneStep({ids_[0], ids_[2]}, particles, false)).steps(0), 9u);
  particles.push_back(63);
  const auto refused = Call(*stub_, &Stub::Step, OneStep({ids_[0], ids_[2]}, particles, false));
  EXPECT_THAT(FieldsOf(refused.status), testing::ElementsAre("view"));
  EXPECT_THAT(refused.status.error_message(), testing::HasSubstr("408 bytes"));
}

TEST_F(ParticleStates, EveryRequestOfAStepStreamHasParticlesOfItsOwn) {
  grpc::ClientContext context;
  const auto stream = stub_->StepStream(&context);
  // Different cloths, so that the states are those at the end.
  const std::vector<List> lists{{63}, {1, 2, 3, 14}, {8, 9, 40}};
  for (size_t k = 0; k < 3; ++k) ASSERT_TRUE(stream->Write(OneStep({ids_[k]}, lists[k], false)));
  stream->WritesDone();
  std::vector<Received> received(3);
  v1::StepResponse response;
  for (Received& answer : received) {
    ASSERT_TRUE(stream->Read(&response));
    answer.Add(response.states());
  }
  EXPECT_TRUE(stream->Finish().ok());
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(received[k].positions, Selected(Whole({ids_[k]}).positions, lists[k]));
    EXPECT_TRUE(received[k].velocities.empty());
  }
}

TEST_F(ParticleStates, ReadStatesSplitsTheRowsOfACloth) {
  const Received whole = Whole(ids_);
  const List one{12}, four{0, 8, 9, 15};
  Received received;
  EXPECT_TRUE(ReadParticles(four, true, received).ok());
  EXPECT_EQ(received.positions, Selected(whole.positions, four));
  EXPECT_EQ(received.velocities, Selected(whole.velocities, four));
  // 3 + 1 of the first cloth, and each of the others begins in a chunk of its own.
  EXPECT_EQ(received.chunks, 6u);
  received = {};
  EXPECT_TRUE(ReadParticles(four, false, received).ok());
  EXPECT_EQ(received.positions, Selected(whole.positions, four));
  EXPECT_EQ(received.chunks, 3u) << "none is split";
  received = {};
  EXPECT_TRUE(ReadParticles(one, true, received).ok());
  EXPECT_EQ(received.velocities, Selected(whole.velocities, one));
  EXPECT_EQ(received.chunks, 1u);
}

TEST_F(ParticleStates, FramesHoldTheRowsThatAreAskedFor) {
  const List particles{3, 4, 12, 13, 15};
  grpc::ClientContext context;
  const auto stream = stub_->StreamStates(&context);
  ASSERT_TRUE(stream->Write(Subscription(particles, 2)));
  const auto read_frame = [&](uint64_t number) {
    Received frame;
    v1::StateChunk chunk;
    do {
      if (!stream->Read(&chunk)) break;
      EXPECT_EQ(chunk.frame(), number);
      frame.Add(chunk);
    } while (!chunk.is_last());
    return frame;
  };
  const Received first = read_frame(1);
  const Received whole = Whole(ids_);
  EXPECT_EQ(first.positions, Selected(whole.positions, particles));
  EXPECT_EQ(first.velocities, Selected(whole.velocities, particles));
  EXPECT_EQ(first.chunks, 6u);
  Step(*stub_, StepsOf(session_, {ids_[1]}, 1));
  const Received second = read_frame(2);
  EXPECT_EQ(second.positions, Selected(Whole({ids_[1]}).positions, particles));
  EXPECT_NE(second.positions.at(ids_[1]), first.positions.at(ids_[1]));
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

// Cloth 1 has 16 particles.
TEST_F(ParticleStates, ParticlesThatSomeClothDoesNotHaveAreNamed) {
  const List strangers{0, 15, 16, 63}, descending{3, 2};
  const auto refused = [&](const List& particles) {
    std::vector<grpc::Status> refusals(4);
    Received received;
    refusals[0] = ReadParticles(particles, false, received);
    EXPECT_EQ(received.chunks, 0u);
    refusals[1] = Call(*stub_, &Stub::Step, OneStep(ids_, particles, false)).status;
    v1::StepResponse response;
    grpc::ClientContext step_context, state_context;
    // A request that is not refused would wait for more.
    const auto soon = std::chrono::system_clock::now() + std::chrono::seconds(20);
    step_context.set_deadline(soon);
    state_context.set_deadline(soon);
    const auto steps = stub_->StepStream(&step_context);
    steps->Write(OneStep(ids_, particles, false));
    EXPECT_FALSE(steps->Read(&response));
    refusals[2] = steps->Finish();
    v1::StateChunk chunk;
    const auto frames = stub_->StreamStates(&state_context);
    frames->Write(Subscription(particles, 1));
    EXPECT_FALSE(frames->Read(&chunk));
    refusals[3] = frames->Finish();
    return refusals;
  };
  const std::vector<std::string> views{"view", "view", "view", "subscribe.view"};
  const std::vector<grpc::Status> too_high = refused(strangers), out_of_order = refused(descending);
  for (size_t k = 0; k < views.size(); ++k) {
    EXPECT_EQ(too_high[k].error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(FieldsOf(too_high[k]),
                testing::ElementsAre(views[k] + ".particles[2]", views[k] + ".particles[3]"));
    EXPECT_THAT(too_high[k].error_message(), testing::HasSubstr("16 is not in [0, 15]"));
    EXPECT_EQ(out_of_order[k].error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(FieldsOf(out_of_order[k]), testing::ElementsAre(views[k] + ".particles[1]"));
  }
  EXPECT_EQ(Get(*stub_, session_, ids_[0]).step(), 8u) << "nothing has moved";
  Received received;
  EXPECT_TRUE(ReadParticles({15}, false, received).ok());
}

}  // namespace
}  // namespace drape::test
