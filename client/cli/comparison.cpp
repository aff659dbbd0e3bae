#include "client/cli/comparison.h"

#include <cmath>

namespace drape::cli {
namespace {

Client Spawn(const std::string& backend) {
  SpawnOptions spawn;
  spawn.backend = backend;
  return Client::SpawnServer(spawn);
}

double Distance(const VectorView& a, const VectorView& b, size_t row) {
  return std::hypot(a.At(row, 0) - b.At(row, 0), a.At(row, 1) - b.At(row, 1),
                    a.At(row, 2) - b.At(row, 2));
}

}  // namespace

void Compare(const States& states, const States& others, PositionDifference* difference) {
  bool is_comparable = states.size() == others.size();
  for (size_t k = 0; is_comparable && k < states.size(); ++k) {
    is_comparable =
        states[k].particle_count == others[k].particle_count && states[k].step == others[k].step;
  }
  if (!is_comparable) {
    ErrorDetails details;
    details.code = ErrorCode::kInternal;
    details.reason = "NOT_COMPARABLE";
    details.message = "the two servers sent states of different cloths or steps";
    throw Error(std::move(details));
  }
  if (std::isnan(difference->largest_m)) return;  // nothing is larger
  for (size_t k = 0; k < states.size(); ++k) {
    for (size_t particle = 0; particle < states[k].particle_count; ++particle) {
      const double distance = Distance(states[k].positions_m, others[k].positions_m, particle);
      if (distance <= difference->largest_m) continue;  // false for NaN
      *difference = {distance, k, particle, states[k].step};
      if (std::isnan(distance)) return;
    }
  }
}

Comparison::Comparison(const std::string& backend, const v1::Scene& scene)
    : client_(Spawn(backend)),
      session_(client_.CreateSession()),
      backend_(client_.GetServerInfo().backend()),
      player_(session_, scene, client_.GetServerInfo().limits()) {}

void Comparison::Advance(uint64_t steps, const States& states,
                         const std::function<bool()>& should_stop) {
  first_steps_ += steps;
  player_.Advance(first_steps_ - player_.step(), /*has_reports=*/false, should_stop);
  if (player_.step() != first_steps_) return;
  Compare(states, session_.ReadStates(), &difference_);
  compared_steps_ = first_steps_;
}

}  // namespace drape::cli
