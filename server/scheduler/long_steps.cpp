// The methods of DeviceLoop about steps that are done in pieces.
#include <algorithm>
#include <utility>

#include "server/core/trace.h"
#include "server/scheduler/device_loop.h"

namespace drape {
namespace {

// Limit on the steps that are done in pieces at the same time: each holds working memory, and much
// of it where cloths touch (max_long_step_bytes).
constexpr size_t kMaxLongSteps = 16;

std::vector<ClothHandle> HandlesOf(const ActiveRequest& request, std::span<const uint32_t> unit) {
  std::vector<ClothHandle> handles;
  for (const uint32_t k : unit) handles.push_back(request.work().cloths[k]->handle());
  return handles;
}

}  // namespace

bool DeviceLoop::IsLong(const ActiveRequest& request, std::span<const uint32_t> unit) const {
  double expected_us = 0;
  for (const uint32_t k : unit) expected_us += request.work().cloths[k]->ExpectedCost_us(rate_);
  return expected_us > static_cast<double>(settings_.batch_budget_us);
}

bool DeviceLoop::HasLongStep(const ActiveRequest& request) const {
  return long_steps_.contains(const_cast<ActiveRequest*>(&request));
}

bool DeviceLoop::LacksRoom(const ActiveRequest& request) const {
  if (long_steps_.empty()) return false;
  uint64_t bytes = backend_.LongStepBytes(HandlesOf(request, request.NextUnit()));
  for (const auto& [other, step] : long_steps_) bytes += step.bytes;
  return long_steps_.size() >= kMaxLongSteps || bytes > settings_.max_long_step_bytes;
}

const ActiveRequest* DeviceLoop::FirstToBegin(int64_t now_us) {
  const auto still_waits = [&](const ActiveRequest& request) {
    return !HasLongStep(request) && !request.is_held() && !HeldBackUntil_us(request, now_us) &&
           request.units_to_step() > 0 && IsLong(request, request.NextUnit());
  };
  if (first_to_begin_ != nullptr && !still_waits(*first_to_begin_)) first_to_begin_ = nullptr;
  return first_to_begin_;
}

bool DeviceLoop::MustWait(const ActiveRequest& request, const ActiveRequest*& first) const {
  if (HasLongStep(request) || (long_steps_.empty() && first == nullptr)) return false;
  if (request.units_to_step() == 0 || !IsLong(request, request.NextUnit())) return false;
  const bool is_of_session = std::ranges::any_of(
      long_steps_, [&](const auto& entry) { return entry.first->session() == request.session(); });
  if (is_of_session) return true;
  if (first != nullptr && first != &request) return true;
  if (!LacksRoom(request)) return false;
  first = &request;
  return true;
}

int64_t DeviceLoop::StepPiece(const std::vector<Part>& parts) {
  ActiveRequest* const request = parts[0].request;
  const std::vector<uint32_t>& unit = parts[0].cloths;
  std::vector<std::shared_ptr<ClothRuntime>> cloths;
  for (const uint32_t k : unit) cloths.push_back(request->work().cloths[k]);
  GiveAnswers();
  ++counters_.long_step_pieces;
  // The backend may have dropped what was begun, because something was written to the cloth.
  const auto [step, begins] = long_steps_.try_emplace(request, LongStep{cloths, 0, 0});
  if (begins) step->second.bytes = backend_.LongStepBytes(HandlesOf(*request, unit));
  for (size_t k = 0; !begins && k < cloths.size(); ++k) cloths[k]->controls().SendAgain();
  const std::vector<StepItem> items = ItemsOf(parts);
  const int64_t begin_us = clock_.NowUs();
  std::optional<BatchReport> batch = BatchReport{};
  if (!items.empty()) {
    const trace::Span span("step_piece");
    batch = backend_.StepPiece(items, Pause::After_us(settings_.batch_budget_us));
  }
  const double spent_us = step->second.spent_us;
  for (const auto& cloth : cloths) cloth->SetInPieces(!batch.has_value());
  if (batch.has_value()) {
    long_steps_.erase(step);
    return EndBatch(parts, *std::move(batch), begin_us, spent_us);
  }
  const int64_t end_us = clock_.NowUs();
  step->second.spent_us += static_cast<double>(end_us - begin_us);
  request->TakeAgain(unit[0]);
  BatchReport piece;
  piece.device_us = end_us - begin_us;
  request->AddBatch(piece, 1, 1, begin_us, end_us);
  ++counters_.rounds;
  counters_.batch_durations.Add(end_us - begin_us);
  return end_us - begin_us;
}

void DeviceLoop::DropLongStep(ActiveRequest* request) {
  const auto step = long_steps_.find(request);
  if (step == long_steps_.end()) return;
  double work = 0;
  for (const std::shared_ptr<ClothRuntime>& cloth : step->second.cloths) {
    work += cloth->work_per_step();
    cloth->SetInPieces(false);
    if (!cloth->is_alive()) continue;
    backend_.AbandonStep(cloth->handle());
    cloth->controls().SendAgain();
  }
  // As a whole: who gives up again and again is to gain nothing.
  rates_.Charge(request->work().tenant, work);
  long_steps_.erase(step);
}

}  // namespace drape
