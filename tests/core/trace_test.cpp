#include "server/core/trace.h"

#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

namespace drape {
namespace {

using nlohmann::json;

json Stopped(trace::Recording* recording = nullptr) {
  const trace::Recording stopped = trace::Stop();
  if (recording != nullptr) *recording = stopped;
  const json object = json::parse(stopped.json, nullptr, /*allow_exceptions=*/false);
  EXPECT_FALSE(object.is_discarded()) << stopped.json.substr(0, 1000);
  return object;
}

// Of these events, by name.
std::map<std::string, int> CountsIn(const json& trace) {
  std::map<std::string, int> counts;
  for (const json& event : trace["traceEvents"]) {
    if (event["ph"] != "M") ++counts[event["name"]];
  }
  return counts;
}

TEST(Trace, HasNothingWhileNobodyRecords) {
  EXPECT_FALSE(trace::IsOn());
  { const trace::Span span("before"); }
  EXPECT_EQ(trace::Now_us(), 0);
  ASSERT_TRUE(trace::Start().ok());
  trace::Waited("wait", 0);
  const json trace = Stopped();
  { const trace::Span span("after"); }
  EXPECT_EQ(CountsIn(trace), (std::map<std::string, int>{}));
  ASSERT_TRUE(trace::Start().ok());
  EXPECT_EQ(CountsIn(Stopped()), (std::map<std::string, int>{}));
}

TEST(Trace, HasWhatThreadsDoAndWhatWaits) {
  trace::NameThread("main");
  ASSERT_TRUE(trace::Start().ok());
  EXPECT_EQ(trace::Start().reason(), "TRACE_IN_PROGRESS");
  const int64_t begin_us = trace::Now_us();
  std::thread([] {
    trace::NameThread("other");
    const trace::Span span("work");
  }).join();
  {
    trace::Span outer("outer");
    outer.Add("cloths", 7);
    outer.Add("dispatches", -1);
    outer.Add("too_many", 1);
    const trace::Span inner("inner");
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  trace::Waited("queue", begin_us);
  trace::Recording recording;
  const json trace = Stopped(&recording);
  EXPECT_EQ(recording.events, 4u);
  EXPECT_EQ(recording.left_out, 0u);
  std::map<std::string, json> of;  // by name, and phase of waits
  std::map<int, std::string> threads;
  for (const json& event : trace["traceEvents"]) {
    if (event["name"] == "thread_name") threads[event["tid"]] = event["args"]["name"];
    const std::string phase = event["ph"];
    of[event["name"].get<std::string>() + (phase == "X" || phase == "M" ? "" : phase)] = event;
  }
  EXPECT_EQ(threads[of["work"]["tid"]], "other");
  EXPECT_EQ(threads[of["outer"]["tid"]], "main");
  EXPECT_EQ(of["outer"]["args"], (json{{"cloths", 7}, {"dispatches", -1}}));
  EXPECT_GE(of["inner"]["dur"], 2000);
  EXPECT_LE(of["outer"]["ts"], of["inner"]["ts"]);
  EXPECT_GE(of["outer"]["ts"].get<int64_t>() + of["outer"]["dur"].get<int64_t>(),
            of["inner"]["ts"].get<int64_t>() + of["inner"]["dur"].get<int64_t>());
  EXPECT_EQ(of["queueb"]["id"], of["queuee"]["id"]);
  EXPECT_GE(of["queuee"]["ts"].get<int64_t>() - of["queueb"]["ts"].get<int64_t>(), 2000);
}

// A span belongs to one recording wholly, or to none.
TEST(Trace, LeavesOutWhatBeganBeforeOrEndsAfter) {
  ASSERT_TRUE(trace::Start().ok());
  {
    const trace::Span across("across");
    trace::Stop();
    ASSERT_TRUE(trace::Start().ok());
  }
  EXPECT_EQ(CountsIn(Stopped()), (std::map<std::string, int>{}));
}

TEST(Trace, IsBoundedAndCountsWhatHadNoRoom) {
  ASSERT_TRUE(trace::Start().ok());
  std::vector<std::thread> threads;
  constexpr uint32_t kEach = trace::kMaxEvents / 4 + 1000;
  for (int k = 0; k < 4; ++k) {
    threads.emplace_back([] {
      for (uint32_t n = 0; n < kEach; ++n) const trace::Span span("span");
    });
  }
  for (std::thread& thread : threads) thread.join();
  const trace::Recording recording = trace::Stop();
  EXPECT_EQ(recording.events, trace::kMaxEvents);
  EXPECT_TRUE(recording.json.ends_with("\"otherData\":{\"events_left_out\":4000}}\n"));
  EXPECT_EQ(recording.left_out, 4000u);
}

// Threads that come and go while recordings begin and end.
TEST(Trace, MayBeginAndEndAtAnyTime) {
  std::atomic<bool> is_over = false;
  std::vector<std::thread> threads;
  for (int k = 0; k < 4; ++k) {
    threads.emplace_back([&] {
      while (!is_over) {
        std::thread([] { const trace::Span span("short"); }).join();
        const trace::Span span("long");
      }
    });
  }
  for (int k = 0; k < 50; ++k) {
    ASSERT_TRUE(trace::Start().ok());
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    Stopped();
  }
  is_over = true;
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace drape
