#include "server/api/step_answer.h"

#include <algorithm>
#include <utility>

#include "server/core/check.h"

namespace drape::api {
namespace {

// Of about half a kilobyte each.
constexpr int kReportsPerMessage = 2048;
// Of about 40 bytes each.
constexpr int kContactsPerMessage = 32768;

void AppendRows(const v1::ContactImpulses& from, int begin, int end, v1::ContactImpulses& to) {
  to.mutable_cloth_ids()->Add(from.cloth_ids().begin() + begin, from.cloth_ids().begin() + end);
  to.mutable_particles()->Add(from.particles().begin() + begin, from.particles().begin() + end);
  to.mutable_colliders()->Add(from.colliders().begin() + begin, from.colliders().begin() + end);
  to.mutable_impulses_n_s()->Add(from.impulses_n_s().begin() + 3 * begin,
                                 from.impulses_n_s().begin() + 3 * end);
}

MessageSlices ToMessage(const v1::StepResponse& rest, const MessageSlices& states) {
  MessageWriter writer;
  writer.AppendFields(rest);
  if (!states.empty()) {
    writer.BeginField(v1::StepResponse::kStatesFieldNumber, ByteSize(states));
    writer.Append(states);
  }
  return std::move(writer).Finish();
}

}  // namespace

StepAnswer::StepAnswer(v1::StepResponse answer, MessageSlices states)
    : rest_(std::move(answer)),
      states_(std::move(states)),
      state_bytes_(ByteSize(states_)),
      has_next_(true) {}

StepAnswer::StepAnswer(v1::StepResponse answer, std::optional<SharedChunks> chunks,
                       uint64_t state_bytes)
    : rest_(std::move(answer)),
      chunks_(std::move(chunks)),
      state_bytes_(state_bytes),
      is_in_chunks_(true),
      has_next_(true) {}

bool StepAnswer::HasMore() const {
  return next_report_ < rest_.reports_size() ||
         next_contact_ < rest_.contact_impulses().particles_size() ||
         (chunks_ && chunks_->has_next());
}

v1::StepResponse StepAnswer::NextPart() {
  v1::StepResponse part;
  google::protobuf::RepeatedPtrField<v1::StepReport> reports;
  v1::ContactImpulses contacts;
  reports.Swap(rest_.mutable_reports());
  if (rest_.has_contact_impulses()) contacts.Swap(rest_.mutable_contact_impulses());
  if (std::exchange(is_first_, false)) part = rest_;
  const int end = std::min(next_report_ + kReportsPerMessage, reports.size());
  for (; next_report_ < end; ++next_report_) {
    part.mutable_reports()->Add(std::move(reports[next_report_]));
  }
  reports.Swap(rest_.mutable_reports());
  const int contacts_end = std::min(next_contact_ + kContactsPerMessage, contacts.particles_size());
  if (next_contact_ < contacts_end) {
    AppendRows(contacts, next_contact_, contacts_end, *part.mutable_contact_impulses());
    next_contact_ = contacts_end;
  }
  if (rest_.has_contact_impulses()) contacts.Swap(rest_.mutable_contact_impulses());
  return part;
}

MessageSlices StepAnswer::Next() {
  DRAPE_CHECK(has_next_, "no message left");
  if (!is_in_chunks_) {
    has_next_ = false;
    return ToMessage(rest_, states_);
  }
  v1::StepResponse part = NextPart();
  MessageSlices states;
  if (chunks_ && chunks_->has_next()) states = chunks_->Next();
  has_next_ = HasMore();
  part.set_continues(has_next_);
  return ToMessage(part, states);
}

}  // namespace drape::api
