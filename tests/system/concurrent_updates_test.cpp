// Several updates of one cloth at the same time: each is acknowledged and seen, or refused.
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/backends/backends.h"
#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"

namespace drape::test {
namespace {

constexpr int kRounds = 40;

class ConcurrentUpdates : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Backends, ConcurrentUpdates, testing::ValuesIn(BackendNames()),
                         NameOfCase<testing::TestParamInfo<std::string>>);

v1::UpdateClothsRequest UpdateOf(const std::string& session, const Ids& ids,
                                 const std::string& path) {
  v1::UpdateClothsRequest request;
  request.set_session(session);
  for (const uint64_t id : ids) request.add_cloth_ids(id);
  request.mutable_update_mask()->add_paths(path);
  return request;
}

v1::UpdateClothsRequest Pins(const std::string& session, const Ids& ids, int count) {
  v1::UpdateClothsRequest request = UpdateOf(session, ids, "pins");
  for (int k = 0; k < count; ++k) {
    request.mutable_spec()->add_pins()->set_particle(static_cast<uint32_t>(k));
  }
  return request;
}

v1::UpdateClothsRequest Bending(const std::string& session, const Ids& ids, double rigidity_n_m) {
  v1::UpdateClothsRequest request = UpdateOf(session, ids, "material.bending_rigidity_n_m");
  request.mutable_spec()->mutable_material()->set_bending_rigidity_n_m(rigidity_n_m);
  return request;
}

TEST_P(ConcurrentUpdates, NoAcknowledgedOneIsLost) {
  InProcessServer server(GetParam());
  const auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const Ids ids = Create(*stub, HangingSheet(session, 6, 2));
  std::atomic<bool> is_over = false;
  std::thread stepping([&] {
    const auto own = server.NewStub();
    while (!is_over) {
      EXPECT_TRUE(Call(*own, &Stub::Step, StepsOf(session, ids, 1)).status.ok());
    }
  });
  for (int round = 0; round < kRounds; ++round) {
    const int pin_count = 1 + round % 5;
    const bool bends = round % 2 == 0;
    const uint64_t id = ids[static_cast<size_t>(round) / 2 % 2];
    const auto change = [&](const v1::UpdateClothsRequest& request) {
      const auto own = server.NewStub();
      const auto answer = Call(*own, &Stub::UpdateCloths, request);
      EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
    };
    std::thread pins(change, Pins(session, ids, pin_count));
    std::thread bending(change, Bending(session, {id}, bends ? 1e-5 : 0));
    pins.join();
    bending.join();
    EXPECT_EQ(Get(*stub, session, id).shape().elastic_elements() > 0, bends);
    for (const uint64_t each : ids) EXPECT_EQ(Get(*stub, session, each).pins_size(), pin_count);
  }
  is_over = true;
  stepping.join();
}

}  // namespace
}  // namespace drape::test
