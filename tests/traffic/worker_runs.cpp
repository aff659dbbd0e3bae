// The methods of Worker that let the server step by itself, and watch every frame of it.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

#include "tests/traffic/sight.h"
#include "tests/traffic/worker.h"

namespace drape::test {
namespace {

// Their intervals are whole microseconds, so what is due is an integer calculation.
constexpr double kPaces_hz[] = {100, 250, 500, 2000};
constexpr double kOverIn_s = 60;

}  // namespace

// A run through connections that are cut. What it made is where its cloths are when it is over; to
// know when that is, only one worker at a time lets run.
void Worker::LetRun() {
  const std::vector<Mark> cloths = SomeCloths(true);
  if (families_[mine_.at(cloths[0]).family].goes_back) return Read();
  const uint64_t before = mine_.at(cloths[0]).step;
  Operation operation = NewOperation(Kind::kRun, cloths);
  const v1::RunRequest::Start start = StartOf(operation, before);
  operation.step.set_steps(static_cast<uint32_t>(start.max_steps()) +
                           1);  // WaitUntilOver makes one
  const std::lock_guard turn(board_.run_turn);
  Do(std::move(operation), [&](Operation& done) {
    std::optional<StateStream> viewer = OpenViewer(done);
    bool was_seen = false;
    {
      RunStream run = session_.Run(start);
      was_seen = Watch(run, start, done);
    }
    WaitUntilOver(was_seen, done);
    // Where they are; those that are faulted stay.
    const std::vector<uint64_t> ids = IdsOf(done.cloths);
    Repeat([&](Session& session) {
      done.told_steps.clear();
      done.told_bits.clear();
      done.told_faulted.clear();
      for (const ClothState& state : session.ReadStates(ids, WholeView())) {
        done.told_steps.push_back(state.step);
        done.told_bits.push_back(BitsOf(state));
      }
      for (const Mark& mark : done.cloths) {
        if (session.GetCloth(mine_.at(mark).id).faulted()) done.told_faulted.push_back(mark);
      }
    });
    for (size_t k = 0; k < done.cloths.size(); ++k) {
      mine_.at(done.cloths[k]).step = done.told_steps[k];
    }
    ReadViewer(std::move(viewer), done);
  });
}

v1::RunRequest::Start Worker::StartOf(const Operation& operation, uint64_t step) {
  v1::RunRequest::Start start;
  for (const uint64_t id : IdsOf(operation.cloths)) start.add_cloth_ids(id);
  start.set_expected_step(step);
  start.set_max_steps(1 + Below(12));
  start.set_report_interval_s(0.01);
  if (Chance(3)) {
    start.set_unpaced(true);
  } else {
    start.set_steps_hz(kPaces_hz[Below(4)]);
    start.set_max_behind_s(0.02);
  }
  return start;
}

bool Worker::Watch(RunStream& run, const v1::RunRequest::Start& start, Operation& operation) {
  bool was_seen = false, is_stopped = false;
  try {
    while (const auto report = run.Next()) {
      was_seen = true;
      if (!is_stopped) CheckReport(*report, start);
      if (report->steps() < operation.told_run_steps) Complain("a run went back");
      operation.told_run_steps = report->steps();
      operation.has_last_report = report->is_last();
      if (Chance(10)) {
        run.SetPaused(true);
        run.SetPaused(false);
      }
      if (Chance(6)) {  // before max_steps: what is under way is in the last report
        run.Stop();
        is_stopped = true;
      }
    }
    if (!operation.has_last_report) Complain("a run ended without its last report");
  } catch (const Error& error) {
    if (error.reason() == "STATE_LOST") throw StateLost();
    if (!IsUncertain(error)) Complain(std::string("a run: ") + error.what());
  }
  return was_seen;
}

void Worker::CheckReport(const v1::RunReport& report, const v1::RunRequest::Start& start) {
  if (report.is_last() || start.unpaced()) return;
  const uint64_t to_come = report.steps() + report.steps_behind();
  if (to_come >= start.max_steps()) return;  // what is due after the last step is not counted
  const auto interval_us = std::llround(1e6 / start.steps_hz());
  const auto due = static_cast<uint64_t>(std::llround(1e6 * report.elapsed_s()) / interval_us + 1);
  if (to_come + report.steps_dropped() == due) return;
  Complain("of a run " + std::to_string(due) + " steps were due, but " + report.ShortDebugString());
}

void Worker::WaitUntilOver(bool was_seen, Operation& operation) {
  const auto wait = [&] {
    const double end_s = board_.now_s() + kOverIn_s;
    while (board_.count_runs() != 0) {
      if (board_.now_s() > end_s) return Complain("a run whose client has gone does not end");
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  };
  if (operation.has_last_report) return wait();
  if (!was_seen) {
    // It may have been sent and not begun: it never begins where its cloths are no longer.
    v1::StepRequest step;
    for (const uint64_t id : IdsOf(operation.cloths)) step.add_cloth_ids(id);
    step.set_steps(1);
    step.set_request_id(NextId());
    Repeat([&](Session& session) { (void)session.Step(Sent(step)); });
    ++operation.told_run_steps;
  }
  wait();
}

std::optional<StateStream> Worker::OpenViewer(Operation& operation) {
  v1::StreamStatesRequest::Subscribe subscribe;
  for (const uint64_t id : IdsOf(operation.cloths)) subscribe.add_cloth_ids(id);
  *subscribe.mutable_view() = WholeView();
  subscribe.set_delivery(v1::StreamStatesRequest::EVERY_FRAME);
  try {
    StateStream viewer = session_.StreamStates(subscribe);
    if (const auto first = viewer.Next()) AddShown(*first, operation);
    return viewer;
  } catch (const Error& error) {
    if (error.reason() == "STATE_LOST") throw StateLost();
    if (!IsUncertain(error)) Complain(std::string("a viewer: ") + error.what());
    return std::nullopt;
  }
}

void Worker::ReadViewer(std::optional<StateStream> viewer, Operation& operation) {
  if (!viewer) return;
  viewer->Stop();
  try {
    while (const auto frame = viewer->Next()) AddShown(*frame, operation);
    operation.is_shown_to_the_end = true;
    ++history_.counts["viewer"];
  } catch (const Error& error) {
    if (error.reason() == "STATE_LOST") throw StateLost();
    if (!IsUncertain(error)) Complain(std::string("a viewer: ") + error.what());
  }
}

void Worker::AddShown(const States& frame, Operation& operation) {
  const std::vector<uint64_t> ids = IdsOf(operation.cloths);
  for (const ClothState& state : frame) {
    const auto at = std::ranges::find(ids, state.cloth_id);
    if (at == ids.end()) return Complain("a frame has a cloth that nobody asked for");
    const Mark& mark = operation.cloths[static_cast<size_t>(at - ids.begin())];
    operation.shown[mark].push_back({state.step, BitsOf(state)});
  }
}

}  // namespace drape::test
