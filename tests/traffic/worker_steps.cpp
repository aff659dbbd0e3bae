// The methods of Worker that step.
#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "tests/traffic/sight.h"
#include "tests/traffic/worker.h"

namespace drape::test {
namespace {

void ClearControls(v1::StepRequest& request) {
  request.clear_pin_controls();
  request.clear_collider_controls();
  request.clear_grip_controls();
  request.clear_rest_length_controls();
}

}  // namespace

v1::StepRequest Worker::Sent(v1::StepRequest request) const {
  if (options_.forgets_request_ids) request.clear_request_id();
  return request;
}

void Worker::Step() {
  const uint32_t dice = Below(10);
  const std::vector<Mark> cloths = SomeCloths(dice < 4);
  const Family& family = families_[mine_.at(cloths[0]).family];
  const bool counts = dice < 4 && !family.goes_back;
  Operation operation = NewOperation(Kind::kStep, cloths);
  operation.step = family.traffic->Steps(options_.session, IdsOf(cloths));
  operation.step.set_steps(1 + Below(3));
  if (!Chance(3)) operation.step.set_report(false);
  if (Chance(2)) operation.step.clear_view();
  if (counts) return StepUntil(std::move(operation));
  if (dice < 6) return StepByStream(std::move(operation));
  if (family.goes_back && Chance(6)) {
    // Some of them from the start, in the same request.
    operation.step.mutable_resets()->add_cloth_ids(mine_.at(cloths[0]).id);
  }
  StepById(std::move(operation));
}

void Worker::Take(Operation& operation, const v1::StepResponse& answer) {
  operation.told_steps.assign(answer.steps().begin(), answer.steps().end());
  for (size_t k = 0; k < operation.cloths.size(); ++k) {
    const uint64_t id = answer.cloth_ids(static_cast<int>(k));
    if (std::ranges::count(answer.faulted_cloth_ids(), id) > 0) {
      operation.told_faulted.push_back(operation.cloths[k]);
    }
    mine_.at(operation.cloths[k]).step = answer.steps(static_cast<int>(k));
  }
  operation.told_bits = BitsOf(answer);
  operation.told_reports = ReportsOf(answer);
}

void Worker::SendAndCancel(const v1::StepRequest& request) {
  ++history_.counts["cancel"];
  try {
    StepStream stream = session_.OpenStepStream();
    stream.Write(Sent(request));
    std::this_thread::sleep_for(std::chrono::microseconds(Below(4) * Below(500)));
    stream.Cancel();
  } catch (const Error&) {
    // It was cut: the same as cancelled.
  }
}

void Worker::StepById(Operation operation) {
  operation.step.set_request_id(NextId());
  Do(std::move(operation), [&](Operation& done) {
    if (Chance(8)) SendAndCancel(done.step);
    v1::StepResponse answer;
    Repeat([&](Session& session) { answer = session.Step(Sent(done.step)); });
    Take(done, answer);
  });
}

// Without an id: it counts. What was done before a cut is seen by the step where cloths are. Only
// for cloths that never go back to a step: a sending that arrives late would be done there again.
// Without controls: they would be applied once more if the first sending ended before a step.
void Worker::StepUntil(Operation operation) {
  ClearControls(operation.step);
  const uint64_t before = mine_.at(operation.cloths[0]).step;
  const uint64_t after = before + operation.step.steps();
  Do(std::move(operation), [&](Operation& done) {
    v1::StepRequest request = done.step;
    request.set_until_step(after);
    request.set_expected_step(before);
    bool was_sent = Chance(8);
    if (was_sent) SendAndCancel(request);
    v1::StepResponse answer;
    bool has_begun = false;
    Repeat([&](Session& session) {
      const bool is_first = !std::exchange(was_sent, true);
      try {
        answer = session.Step(request);
      } catch (const Error& error) {
        if (error.reason() != "STEP_MISMATCH") throw;
        // The library itself may have sent it before.
        if (is_first && error.details().unanswered_tries == 0)
          Complain("a cloth was not where it had been: " + std::string(error.what()));
        has_begun = true;
      }
    });
    if (has_begun) {
      v1::StepRequest rest;
      *rest.mutable_cloth_ids() = request.cloth_ids();
      rest.set_until_step(after);
      rest.set_report(request.report());  // measuring counts warnings
      if (request.has_view()) *rest.mutable_view() = request.view();
      Repeat([&](Session& session) { answer = session.Step(rest); });
    }
    Take(done, answer);
    // Measured after a step of its own, or not at all.
    if (has_begun) done.told_reports.clear();
  });
}

// Several requests on one stream, which is perhaps cancelled. After that, or a cut, another stream
// takes those without an answer, one at a time: the first may still be under way there, and those
// behind it would overtake it.
void Worker::StepByStream(Operation operation) {
  const uint32_t count = 2 + Below(2);
  auto& operations = history_.epochs.back().operations;
  const size_t first = operations.size();
  for (uint32_t k = 0; k < count; ++k) {
    Operation next = operation;
    next.step.set_request_id(NextId());
    if (k > 0) ClearControls(next.step);
    operations.push_back(std::move(next));
  }
  ++history_.counts["stream"];
  const bool cancels = Chance(6);
  history_.counts["cancel"] += cancels ? 1 : 0;
  size_t next = first;
  bool is_repeated = false;
  Repeat([&](Session&) {
    StepStream stream = session_.OpenStepStream();
    const auto write = [&](size_t k) {
      try {
        stream.Write(Sent(operations[k].step));
      } catch (const Error&) {
        // Read tells why.
      }
    };
    const bool is_first = !std::exchange(is_repeated, true);
    for (size_t k = next; is_first && k < first + count; ++k) write(k);
    if (is_first && cancels) {
      std::this_thread::sleep_for(std::chrono::microseconds(Below(4) * Below(500)));
      stream.Cancel();
    }
    while (next < first + count) {
      if (!is_first) write(next);
      const auto answer = stream.Read();
      if (!answer) return Complain("a stream ended before its answers");
      Take(operations[next], *answer);
      operations[next].is_acknowledged = true;
      operations[next].acknowledged_s = board_.now_s();
      ++board_.operations;
      ++next;
    }
  });
}

void Worker::StepShared() {
  const std::string incarnation = history_.epochs.back().incarnation;
  ++history_.counts["shared"];
  v1::StepRequest request;
  request.add_cloth_ids(options_.shared_cloth);
  request.set_steps(1);
  request.set_request_id(NextId());
  try {
    if (Chance(8)) SendAndCancel(request);
    Repeat([&](Session& session) { (void)session.Step(Sent(request)); });
  } catch (const StateLost&) {
    board_.count_shared(incarnation, false);
    throw;
  }
  board_.count_shared(incarnation, true);
  ++board_.operations;
}

}  // namespace drape::test
