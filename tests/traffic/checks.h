// A history against the model of the service. Each gives back what is wrong, in words; nothing if
// all is well.
#pragma once

#include <string>
#include <vector>

#include "tests/traffic/history.h"

namespace drape::test {

// What is wrong, and how much was looked at.
struct Verdict {
  std::vector<std::string> findings;
  uint64_t steps_checked = 0;  // of cloths, acknowledged
  uint64_t lost_steps = 0;
  uint64_t doubled_steps = 0;
  uint64_t frames_checked = 0;  // of cloths, for viewers of every frame

  void Add(Verdict more);
};

// By counting alone: a cloth has made the steps that its client was told of, no more and no fewer,
// and a run those that it reported; no frame is missing where every frame was asked for; nothing of
// another tenant answered; no id was given twice; tenants hold nothing at the end.
Verdict CheckCounts(const TrafficHistory& history);

// By doing it again: on a fresh server, whose connections nobody cuts, the accepted requests of
// each worker give every state and report that it was told of, bit for bit. After a start of the
// server its cloths are, all together, as they were at one moment before, with all that they go on
// from; nothing is missing that was acknowledged before ServerRun::kept_until_s.
Verdict CheckReplay(const TrafficHistory& history);

}  // namespace drape::test
