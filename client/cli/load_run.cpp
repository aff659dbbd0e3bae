#include "client/cli/load_run.h"

#include <algorithm>
#include <thread>
#include <utility>

#include "client/cli/load_viewers.h"

namespace drape::cli {
namespace {

using std::chrono::duration;
using std::chrono::duration_cast;
using std::chrono::milliseconds;

// Answers that are remembered for viewers: two seconds of the fastest steps.
constexpr size_t kAnswersKept = 16384;
// A request sent later than this after it was due counts as delayed.
constexpr milliseconds kLate{1};
// Pause after a failure that names none, and the longest one.
constexpr milliseconds kPause{10};
constexpr milliseconds kLongestPause{1000};
// No client is idle for so long.
constexpr double kLease_s = 3600;

double Milliseconds(LoadClock::duration time) {
  return duration<double, std::milli>(time).count();
}

LoadClock::duration Seconds(double seconds) {
  return duration_cast<LoadClock::duration>(duration<double>(seconds));
}

std::string ReasonOf(const Error& error) {
  return error.reason().empty() ? std::string(ErrorCodeName(error.code())) : error.reason();
}

SessionOptions LoadSession() {
  SessionOptions options;
  options.ttl_s = kLease_s;
  options.display_name = "drape load";
  options.renews_lease = false;  // every request renews it
  return options;
}

Error StreamEnded() {
  ErrorDetails details;
  details.code = ErrorCode::kUnavailable;
  details.reason = "STREAM_ENDED";
  return Error(std::move(details));
}

std::vector<ClothId> IdsOf(const ScenePlayer& player) {
  std::vector<ClothId> ids;
  for (const PlayedCloth& cloth : player.cloths()) ids.push_back(cloth.id);
  return ids;
}

template <class Act>
void ForEachInParallel(size_t count, Act act) {
  std::vector<std::thread> threads;
  for (size_t k = 0; k < count; ++k) threads.emplace_back(act, k);
  for (std::thread& thread : threads) thread.join();
}

}  // namespace

void AnswerTimes::Add(uint64_t step, LoadClock::time_point at) {
  const std::lock_guard lock(mutex_);
  answers_.emplace_back(step, at);
  if (answers_.size() > kAnswersKept) answers_.pop_front();
}

std::optional<LoadClock::time_point> AnswerTimes::Of(uint64_t step) const {
  const std::lock_guard lock(mutex_);
  // Requests of several steps are answered after the last one, so the frame's own step may lie
  // between two answers: the later one counts.
  const auto found =
      std::lower_bound(answers_.begin(), answers_.end(), step,
                       [](const auto& answer, uint64_t wanted) { return answer.first < wanted; });
  if (found == answers_.end()) return std::nullopt;
  return found->second;
}

LoadSchedule::LoadSchedule(const LoadPlan& plan, double rate_per_s, LoadClock::time_point start)
    : rate_per_s_(rate_per_s),
      request_count_(plan.request_count),
      is_poisson_(plan.is_poisson),
      end_(start + Seconds(plan.interval_s)),
      due_(start) {}

std::optional<LoadClock::time_point> LoadSchedule::Draw() {
  if (request_count_ > 0 && drawn_ == request_count_) return std::nullopt;
  if (rate_per_s_ == 0) {
    ++drawn_;
    return LoadClock::now();
  }
  if (due_ >= end_) return std::nullopt;
  ++drawn_;
  const double gap_s =
      is_poisson_ ? std::exponential_distribution<double>(rate_per_s_)(random_) : 1 / rate_per_s_;
  return std::exchange(due_, due_ + Seconds(gap_s));
}

std::optional<LoadClock::time_point> LoadSchedule::Next() {
  const std::lock_guard lock(mutex_);
  if (LoadClock::now() >= end_) return std::nullopt;
  return Draw();
}

uint64_t LoadSchedule::CountUnsent() {
  if (rate_per_s_ == 0) return 0;
  const std::lock_guard lock(mutex_);
  uint64_t unsent = 0;
  while (Draw().has_value()) ++unsent;
  return unsent;
}

LoadClient::LoadClient(const LoadPlan& plan) : plan_(plan), client_(plan.connect()) {
  Prepare();
}

void LoadClient::Prepare() {
  if (plan_.request == LoadRequest::kSession) return;
  if (!session_) {
    session_.emplace(client_.CreateSession(LoadSession()));
    has_cloths_ = false;
  }
  if (plan_.request == LoadRequest::kStep && !has_cloths_) {
    const ScenePlayer player(*session_, plan_.scene, plan_.limits);
    has_cloths_ = true;
  }
  if (plan_.by_stream && !stream_) stream_.emplace(session_->OpenStepStream());
}

const std::string& LoadClient::session_name() {
  Prepare();
  return session_->name();
}

void LoadClient::Step(LoadSamples& samples) {
  v1::StepRequest request;
  request.set_all_cloths(true);
  request.set_steps(plan_.steps);
  if (plan_.has_positions) request.mutable_view()->set_positions(true);
  std::optional<v1::StepResponse> response;
  if (plan_.by_stream) {
    stream_->Write(std::move(request));
    response = stream_->Read();
  } else {
    response = session_->Step(std::move(request));
  }
  if (!response) throw StreamEnded();
  samples.cloth_steps += uint64_t{plan_.steps} * response->steps_size();
  const v1::StepTiming& timing = response->timing();
  samples.queue_us += timing.queue_us();
  samples.upload_us += timing.upload_us();
  samples.device_us += timing.device_us();
  samples.readback_us += timing.readback_us();
  samples.encode_us += timing.encode_us();
  if (plan_.viewers > 0 && response->steps_size() > 0) {
    answers_.Add(response->steps(0), LoadClock::now());
  }
}

void LoadClient::Request(LoadSamples& samples) {
  Prepare();
  switch (plan_.request) {
    case LoadRequest::kStep:
      return Step(samples);
    case LoadRequest::kCreate: {
      const ScenePlayer player(*session_, plan_.scene, plan_.limits);
      session_->DeleteCloths(IdsOf(player));
      return;
    }
    case LoadRequest::kSession: {
      Session session = client_.CreateSession(LoadSession());
      const ScenePlayer player(session, plan_.scene, plan_.limits);
      session.Delete();
      return;
    }
  }
}

void LoadClient::Failed(const Error& error, LoadSamples& samples) {
  ++samples.errors[ReasonOf(error)];
  stream_.reset();
  if (error.code() == ErrorCode::kNotFound) session_.reset();
  const milliseconds pause = error.details().retry_after.value_or(kPause);
  std::this_thread::sleep_for(std::clamp(pause, milliseconds(0), kLongestPause));
}

void LoadClient::WarmUp() {
  LoadSamples ignored;
  try {
    for (uint32_t k = 0; k < plan_.warm_up_requests; ++k) Request(ignored);
  } catch (const Error&) {  // the window shows it again
    stream_.reset();
  }
}

LoadSamples LoadClient::Run(LoadSchedule& schedule) {
  LoadSamples samples;
  while (const std::optional<LoadClock::time_point> due = schedule.Next()) {
    std::this_thread::sleep_until(*due);
    // Latency counts from the time at which the request was due: that it was sent late, because
    // others were slow, is part of what users wait.
    samples.delayed += LoadClock::now() > *due + kLate;
    try {
      Request(samples);
      samples.latencies_ms.push_back(Milliseconds(LoadClock::now() - *due));
    } catch (const Error& error) {
      Failed(error, samples);
    }
  }
  return samples;
}

LoadSamples LoadClients::RunWindow(const LoadLevel& level) {
  const size_t first_new = clients_.size();
  while (clients_.size() < level.clients) clients_.push_back(std::make_unique<LoadClient>(plan_));
  ForEachInParallel(clients_.size() - first_new,
                    [&](size_t k) { clients_[first_new + k]->WarmUp(); });
  LoadViewers viewers(plan_, {clients_.data(), level.clients});
  const auto start = LoadClock::now();
  LoadSchedule schedule(plan_, level.rate_per_s, start);
  std::vector<LoadSamples> samples(level.clients);
  ForEachInParallel(level.clients, [&](size_t k) { samples[k] = clients_[k]->Run(schedule); });
  LoadSamples all;
  for (const LoadSamples& of_client : samples) all.Add(of_client);
  all.delayed += schedule.CountUnsent();
  viewers.StopAndAdd(all);
  all.wall_s = duration<double>(LoadClock::now() - start).count();
  return all;
}

}  // namespace drape::cli
