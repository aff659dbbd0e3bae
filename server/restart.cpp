#include "server/restart.h"

#include <fcntl.h>
#include <linux/close_range.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>

#include "server/core/clock.h"
#include "server/core/device_loss.h"

namespace drape {
namespace {

constexpr char kVariable[] = "DRAPE_FORMER_RUN_FD";

std::string ReadToEnd(int file) {
  std::string text;
  char buffer[4096];
  lseek(file, 0, SEEK_SET);
  while (true) {
    const ssize_t count = read(file, buffer, sizeof(buffer));
    if (count <= 0) return text;
    text.append(buffer, static_cast<size_t>(count));
  }
}

bool WriteAll(int file, const std::string& text) {
  size_t written = 0;
  while (written < text.size()) {
    const ssize_t count = write(file, text.data() + written, text.size() - written);
    if (count <= 0) return false;
    written += static_cast<size_t>(count);
  }
  return true;
}

std::string ErrorText(const char* what) {
  return std::string(what) + ": " + std::strerror(errno);
}

// Returns only if that fails, and why.
std::string BeginAnew(const std::vector<std::string>& arguments, const FormerRun& left) {
  const nlohmann::json json = {{"losses_unix_s", left.losses_unix_s},
                               {"had_gpu", left.had_gpu},
                               {"port", left.port},
                               {"sessions", left.sessions}};
  // Names of sessions are secrets: in memory that only the next process gets.
  const int file = memfd_create("former-run", 0);
  if (file < 0) return ErrorText("memfd_create");
  const std::string text = json.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  if (!WriteAll(file, text)) return ErrorText("write");
  setenv(kVariable, std::to_string(file).c_str(), 1);
  const auto first = static_cast<unsigned>(file);
  if (first > 3 && close_range(3, first - 1, CLOSE_RANGE_CLOEXEC) != 0) {
    return ErrorText("close_range");
  }
  if (close_range(first + 1, ~0u, CLOSE_RANGE_CLOEXEC) != 0) return ErrorText("close_range");
  std::vector<char*> pointers;
  for (const std::string& argument : arguments)
    pointers.push_back(const_cast<char*>(argument.c_str()));
  pointers.push_back(nullptr);
  execv("/proc/self/exe", pointers.data());
  return ErrorText("execv");
}

}  // namespace

FormerRun TakeFormerRun() {
  const char* const variable = std::getenv(kVariable);
  if (variable == nullptr) return {};
  const int file = std::atoi(variable);
  unsetenv(kVariable);
  const nlohmann::json json = nlohmann::json::parse(ReadToEnd(file), nullptr, false);
  close(file);
  FormerRun left;
  try {
    json.at("losses_unix_s").get_to(left.losses_unix_s);
    json.at("had_gpu").get_to(left.had_gpu);
    json.at("port").get_to(left.port);
    json.at("sessions").get_to(left.sessions);
  } catch (const nlohmann::json::exception&) {
    return {};  // not from us
  }
  return left;
}

LossHandling::LossHandling(std::vector<std::string> arguments, FormerRun former)
    : arguments_(std::move(arguments)), former_losses_unix_s_(former.losses_unix_s) {
  Replace([former = std::move(former)] { return former; });
}

void LossHandling::Replace(std::function<FormerRun()> what_is_left) {
  if (!what_is_left) return OnDeviceLoss({});
  OnDeviceLoss([this, what_is_left](const std::string& reason) {
    const double now_unix_s = NowUnix_s();
    FormerRun left = what_is_left();
    left.losses_unix_s = former_losses_unix_s_;
    left.losses_unix_s.push_back(now_unix_s);
    std::erase_if(left.losses_unix_s,
                  [&](double loss_unix_s) { return now_unix_s - loss_unix_s > kLossWindow_s; });
    const bool begins_anew = left.losses_unix_s.size() < kMaxLosses;
    spdlog::error("device_lost reason=\"{}\" sessions={} begins_anew={}", reason,
                  left.sessions.size(), begins_anew);
    spdlog::default_logger()->flush();
    if (!begins_anew) std::_Exit(1);
    spdlog::error("failed reason=NOT_BEGUN_ANEW message=\"{}\"", BeginAnew(arguments_, left));
  });
}

LossHandling::~LossHandling() {
  OnDeviceLoss({});
}

}  // namespace drape
