#include "tests/traffic/sight.h"

#include <cmath>
#include <span>

#include "tests/traffic/snapshot_cloths.h"

namespace drape::test {
namespace {

constexpr double kOrigin_m = 1.0 / 1024;

template <class Number>
void Append(std::span<const Number> numbers, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes());
}

}  // namespace

const char* NameOf(Kind kind) {
  constexpr const char* kNames[] = {"create", "step", "run",  "reset",  "update", "write",
                                    "save",   "load", "drop", "delete", "import", "read"};
  return kNames[static_cast<size_t>(kind)];
}

uint64_t HashOf(const std::string& bytes) {
  uint64_t hash = 0xcbf29ce484222325u;
  for (const char byte : bytes) hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001b3u;
  return hash;
}

void SetOrigin(const Mark& mark, google::protobuf::RepeatedField<double>* origins_m) {
  origins_m->Add(kOrigin_m * mark.worker);
  origins_m->Add(0);
  origins_m->Add(kOrigin_m * mark.number);
}

Mark MarkOf(const v1::Cloth& cloth) {
  return {static_cast<uint32_t>(std::lround(cloth.environment_origin_m(0) / kOrigin_m)),
          static_cast<uint32_t>(std::lround(cloth.environment_origin_m(2) / kOrigin_m))};
}

uint64_t TextOf(const v1::Cloth& cloth) {
  v1::Cloth text;
  *text.mutable_environment() = cloth.environment();
  *text.mutable_settings() = cloth.settings();
  *text.mutable_pins() = cloth.pins();
  return HashOf(text.DebugString());
}

uint64_t BitsOf(const ClothState& state) {
  std::string bytes;
  for (const VectorView* view : {&state.positions_m, &state.velocities_m_per_s}) {
    Append(view->floats(), bytes);
    Append(view->doubles(), bytes);
  }
  return HashOf(bytes);
}

v1::StateView WholeView() {
  v1::StateView view;
  view.set_positions(true);
  view.set_velocities(true);
  return view;
}

Sight Look(const Session& session) {
  Sight sight = Glance(session);
  if (sight.ids.empty()) return sight;
  sight.snapshot = session.TakeSnapshot();
  const std::map<uint64_t, std::string> wholes = WholesIn(sight.snapshot);
  for (auto& [mark, seen] : sight.photo) seen.whole = wholes.at(sight.ids.at(mark));
  return sight;
}

Sight Glance(const Session& session) {
  Sight sight;
  std::map<uint64_t, Seen*> seen;
  for (const v1::Cloth& cloth : session.ListCloths()) {
    const Mark mark = MarkOf(cloth);
    sight.ids[mark] = cloth.id();
    sight.photo[mark] = {.step = cloth.step(), .time_s = cloth.time_s(), .text = TextOf(cloth)};
    seen[cloth.id()] = &sight.photo[mark];
  }
  if (seen.empty()) return sight;
  for (const ClothState& state : session.ReadStates(WholeView())) {
    if (seen.contains(state.cloth_id)) seen[state.cloth_id]->bits = BitsOf(state);
  }
  return sight;
}

std::vector<uint64_t> BitsOf(const v1::StepResponse& answer) {
  std::vector<uint64_t> bits;
  if (!answer.has_states()) return bits;
  for (const ClothState& state : States({answer.states()})) bits.push_back(BitsOf(state));
  return bits;
}

std::vector<uint64_t> ReportsOf(const v1::StepResponse& answer) {
  std::vector<uint64_t> reports;
  for (v1::StepReport report : answer.reports()) {
    report.clear_cloth_id();
    reports.push_back(HashOf(report.DebugString()));
  }
  return reports;
}

}  // namespace drape::test
