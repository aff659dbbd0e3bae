// A history against the model of the service. Each gives back what is wrong, in words; nothing if
// all is well.
#pragma once

#include <string>
#include <vector>

#include "tests/traffic/history.h"

namespace drape::test {

using Findings = std::vector<std::string>;

// By counting alone: a cloth has made the steps that its client was told of, no more and no fewer;
// nothing of another tenant answered; tenants hold nothing at the end.
Findings CheckCounts(const TrafficHistory& history);

// By doing it again: on a fresh server, whose connections nobody cuts, the accepted requests of
// each worker give every state and report that it was told of, bit for bit. After a start of the
// server its cloths are, all together, as they were at one moment before: not later than the
// server ended, nor earlier than one interval (kill) or than the last answer (drain).
Findings CheckReplay(const TrafficHistory& history, double checkpoint_interval_s);

}  // namespace drape::test
