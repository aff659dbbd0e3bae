#include "server/api/step_answer.h"

#include <algorithm>
#include <utility>

#include "server/core/check.h"

namespace drape::api {
namespace {

// Of about half a kilobyte each.
constexpr int kReportsPerMessage = 2048;

}  // namespace

StepAnswer::StepAnswer(v1::StepResponse answer, std::optional<StateChunker> states,
                       uint64_t state_bytes)
    : rest_(std::move(answer)),
      states_(std::move(states)),
      state_bytes_(state_bytes),
      is_in_chunks_(true),
      has_next_(true) {}

bool StepAnswer::HasMore() const {
  return next_report_ < rest_.reports_size() || (states_ && states_->has_next());
}

void StepAnswer::Next(v1::StepResponse* message) {
  DRAPE_CHECK(has_next_, "no message left");
  if (!is_in_chunks_) {
    has_next_ = false;
    *message = std::move(rest_);
    return;
  }
  message->Clear();
  google::protobuf::RepeatedPtrField<v1::StepReport> reports;
  reports.Swap(rest_.mutable_reports());
  if (std::exchange(is_first_, false)) *message = rest_;
  const int end = std::min(next_report_ + kReportsPerMessage, reports.size());
  for (; next_report_ < end; ++next_report_) {
    message->mutable_reports()->Add(std::move(reports[next_report_]));
  }
  reports.Swap(rest_.mutable_reports());
  if (states_ && states_->has_next()) states_->Next(message->mutable_states());
  has_next_ = HasMore();
  message->set_continues(has_next_);
}

}  // namespace drape::api
