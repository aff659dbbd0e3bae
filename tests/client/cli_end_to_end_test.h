// Running `drape run` on scenes and reading its report.
#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/client/client_test_support.h"

namespace drape::client_test {

// Fields that every report, cloth and sample has, in the order of the contract.
inline const std::vector<std::string> kReportFields = {
    "scene", "backend", "device", "steps", "wall_ms_per_step", "device_ms_per_step", "cloths"};
inline const std::vector<std::string> kClothFields = {"id",       "particles", "constraints",
                                                      "colours",  "plan",      "samples",
                                                      "warnings", "faulted",   "fault_reason"};
inline const std::vector<std::string> kSampleFields = {"step",
                                                       "time_s",
                                                       "max_strain",
                                                       "rms_strain",
                                                       "strain_p50",
                                                       "strain_p90",
                                                       "strain_p99",
                                                       "rms_motion_m",
                                                       "kinetic_energy_j",
                                                       "potential_energy_j",
                                                       "strain_energy_j",
                                                       "lowest_m",
                                                       "contacts",
                                                       "max_penetration_m",
                                                       "iterations",
                                                       "max_residual_m",
                                                       "near_pairs",
                                                       "smallest_distance_m",
                                                       "crossings",
                                                       "colliders",
                                                       "pins"};

inline std::vector<std::string> Keys(const nlohmann::ordered_json& object) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : object.items()) keys.push_back(key);
  return keys;
}

// `drape run SCENE arguments...` on the cpu backend with a report; checks that it succeeds and
// returns the report.
inline nlohmann::ordered_json RunForReport(const std::string& scene,
                                           std::vector<std::string> arguments,
                                           const std::string& backend = "cpu") {
  const TemporaryFolder folder;
  const std::string report = folder / "report.json";
  arguments.insert(arguments.begin(), {"run", scene, "--report=" + report, "--backend=" + backend});
  const Outcome outcome = RunProgram("drape", arguments);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  if (outcome.exit_code != 0) return {};
  return nlohmann::ordered_json::parse(ReadText(report));
}

}  // namespace drape::client_test
