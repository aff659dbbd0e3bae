// The numbers that a server shows on its port for monitoring.
#pragma once

#include <string>

#include "tests/system/server_process.h"

namespace drape::test {

// /metrics of a server started with --metrics-listen=127.0.0.1:0. Empty, with a failure, if it does
// not answer.
std::string MetricsOf(const ServerProcess& server);
// The value of a number without labels; -1, with a failure, if there is none.
double MetricIn(const std::string& metrics, const std::string& name);

}  // namespace drape::test
