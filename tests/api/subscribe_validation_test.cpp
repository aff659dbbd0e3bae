#include "server/api/stream_validation.h"
#include "tests/api/bad_cases.h"
#include "tests/api/requests.h"

namespace drape::api {
namespace {

using test::ExpectViolation;
using test::kNaN;
using test::Set;

TEST(SubscribeValidation, RefusesRatesThatAreNone) {
  v1::StreamStatesRequest::Subscribe request;
  ExpectViolation(CheckSubscribe(request).status(), "subscribe.cloth_ids", "all_cloths");
  request.set_all_cloths(true);
  request.set_max_hz(-1);
  ExpectViolation(CheckSubscribe(request).status(), "subscribe.max_hz", "-1");
  request.set_max_hz(kNaN);
  ExpectViolation(CheckSubscribe(request).status(), "subscribe.max_hz", "nan");
  request.set_max_hz(1e-9);
  ExpectViolation(CheckSubscribe(request).status(), "subscribe.max_hz", "1e-09");
  request.set_max_hz(2e6);
  ExpectViolation(CheckSubscribe(request).status(), "subscribe.max_hz", "[0.001, ");
  for (const double legal_hz : {0.0, 0.001, 1e6}) {
    request.set_max_hz(legal_hz);
    EXPECT_TRUE(CheckSubscribe(request).ok()) << legal_hz;
  }
  request.set_max_hz(30);
  EXPECT_EQ(CheckSubscribe(request)->every_n_steps, 1u);
}

TEST(SubscribeValidation, RefusesParticlesThatDoNotAscend) {
  v1::StreamStatesRequest::Subscribe request;
  request.set_all_cloths(true);
  Set(request.mutable_view()->mutable_particles(), {0, 4, 6});
  EXPECT_EQ(CheckSubscribe(request)->view.fields, (StateFields{true, false, {0, 4, 6}}));
  request.mutable_view()->set_particles(2, 4);
  ExpectViolation(CheckSubscribe(request).status(), "subscribe.view.particles[2]",
                  "4 is not above 4");
}

TEST(SubscribeValidation, EveryFrameHasAQueueAndNoRate) {
  v1::StreamStatesRequest::Subscribe request;
  request.set_all_cloths(true);
  EXPECT_FALSE(CheckSubscribe(request)->queue.has_value());
  request.set_max_queued_frames(5);
  ExpectViolation(CheckSubscribe(request).status(), "subscribe.max_queued_frames", "EVERY_FRAME");
  request.clear_max_queued_frames();
  request.set_max_queued_bytes(5);
  ExpectViolation(CheckSubscribe(request).status(), "subscribe.max_queued_bytes", "EVERY_FRAME");

  request.set_delivery(v1::StreamStatesRequest::EVERY_FRAME);
  ASSERT_TRUE(CheckSubscribe(request).ok());
  EXPECT_EQ(CheckSubscribe(request)->queue->max_frames, 256u);
  EXPECT_EQ(CheckSubscribe(request)->queue->max_bytes, 5u);
  request.set_max_queued_bytes((uint64_t{1} << 28) + 1);
  ExpectViolation(CheckSubscribe(request).status(), "subscribe.max_queued_bytes", "268435457");
  request.set_max_queued_bytes(uint64_t{1} << 28);
  for (const uint32_t illegal : {1u, 65537u}) {
    request.set_max_queued_frames(illegal);
    ExpectViolation(CheckSubscribe(request).status(), "subscribe.max_queued_frames",
                    "[2, 65536] frames");
  }
  request.set_max_queued_frames(65536);
  EXPECT_TRUE(CheckSubscribe(request).ok());
  request.set_max_hz(30);
  ExpectViolation(CheckSubscribe(request).status(), "subscribe.max_hz", "EVERY_FRAME");
  request.clear_max_hz();
  request.set_initial_credit(1);
  ExpectViolation(CheckSubscribe(request).status(), "subscribe.initial_credit", "EVERY_FRAME");
  request.clear_initial_credit();
  request.set_delivery(static_cast<v1::StreamStatesRequest::Delivery>(7));
  ExpectViolation(CheckSubscribe(request).status(), "subscribe.delivery", "7");
}

}  // namespace
}  // namespace drape::api
