// Cloths as the histories have them.
#pragma once

#include <drape/client.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tests/traffic/history.h"

namespace drape::test {

uint64_t HashOf(const std::string& bytes);

// The mark, as the origin of an environment; exact in any precision.
void SetOrigin(const Mark& mark, google::protobuf::RepeatedField<double>* origins_m);
Mark MarkOf(const v1::Cloth& cloth);

// Of `cloth`, without its step, time and state.
uint64_t TextOf(const v1::Cloth& cloth);
uint64_t BitsOf(const ClothState& state);
v1::StateView WholeView();

// All cloths of the session, their ids, and a snapshot of them; empty: there are none.
struct Sight {
  Photo photo;
  std::map<Mark, uint64_t> ids;
  std::string snapshot;
};
Sight Look(const Session& session);
// The same without a snapshot, and so without Seen::whole.
Sight Glance(const Session& session);

// Of an answer to a step with WholeView: of each of its cloths the bits, or nothing.
std::vector<uint64_t> BitsOf(const v1::StepResponse& answer);
// The hash of each report, without its id.
std::vector<uint64_t> ReportsOf(const v1::StepResponse& answer);

}  // namespace drape::test
