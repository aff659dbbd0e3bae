#include "server/api/request_validation.h"
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

}  // namespace
}  // namespace drape::api
