// METHOD of the atlas: hard cases x methods x backends, each judged by one rule.
#include "tests/bench/stability/stability.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include "tests/bench/stability/hang_guard.h"
#include "tests/bench/stability/random_rows.h"
#include "tests/stability/atlas/trial.h"

namespace drape::bench {
namespace {

using test::AtlasForm;
using test::AtlasMethod;
using test::AtlasTable;
using test::AxisValue;

const std::vector<std::string> kColumns = {
    "table",  "title",       "row_axis",   "row",      "column_axis", "column",   "backend",
    "method", "time_step_s", "substeps",   "steps",    "is_cut",      "verdict",  "violation",
    "in_bar", "max_strain",  "end_strain", "max_gain", "end_gain",    "warnings", "wall_s"};

// The named ones, or all. std::runtime_error names an unknown one and those that exist, `also`
// among them.
template <class Named>
std::vector<Named> Chosen(std::vector<Named> all, const std::vector<std::string>& names,
                          const std::string& option, const std::string& also = "") {
  if (names.empty()) return all;
  std::vector<Named> chosen;
  for (const std::string& name : names) {
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const Named& one) { return one.name == name; });
    if (found == all.end()) {
      std::string legal;
      for (const Named& one : all) legal += " " + one.name;
      legal += also;
      throw std::runtime_error(option + ": '" + name + "' is none of" + legal);
    }
    chosen.push_back(*found);
  }
  return chosen;
}

bool HasRandomTable(const std::vector<std::string>& tables) {
  return tables.empty() || std::ranges::count(tables, kRandomTable) > 0;
}

std::vector<std::string> AtlasNames(std::vector<std::string> tables) {
  std::erase(tables, kRandomTable);
  return tables;
}

// A column of a CSV file has no commas.
std::string WithoutCommas(std::string text) {
  std::replace(text.begin(), text.end(), ',', ';');
  return text;
}

class Atlas {
 public:
  Atlas(Bench& bench, const StabilityOptions& options)
      : bench_(bench),
        guard_(options.cell_s + kHang_s),
        table_(bench.OpenTable("stability", kColumns)) {
    limits_.wall_s = options.cell_s;
    if (bench.is_quick()) limits_.steps = 3;
  }

  // All tables by one method on one backend; false when the time budget is used up.
  bool Try(NamedBackend& backend, const AtlasMethod& method,
           const std::vector<AtlasTable>& tables) {
    test::Neighbour neighbour(*backend.backend, method.settings);
    for (const AtlasTable& table : tables) {
      if (!bench_.StartRow(table.name + ", " + method.name + ", " + backend.name)) return false;
      for (const AxisValue& row : table.rows.values) {
        for (const AxisValue& column : table.columns.values) {
          TryCell(backend, neighbour, method, table, row, column);
        }
      }
    }
    return true;
  }

 private:
  void TryCell(NamedBackend& backend, test::Neighbour& neighbour, const AtlasMethod& method,
               const AtlasTable& table, const AxisValue& row, const AxisValue& column) {
    const test::AtlasCase atlas_case = table.make(row.value, column.value);
    StepSettings settings = method.settings;
    settings.time_step_s = atlas_case.time_step_s;
    const std::string cell = table.name + ": " + row.label + ", " + column.label;
    guard_.Watch(cell + ", " + method.name + ", " + backend.name);
    const test::TrialResult result =
        test::RunTrial(*backend.backend, neighbour, atlas_case, settings, limits_);
    const bool is_in_bar =
        method.name == "REALTIME" && table.is_within_bar(row.value, column.value);
    const std::string verdict(test::VerdictName(result.verdict));
    table_.Add({table.name,
                WithoutCommas(table.title),
                table.rows.name,
                row.label,
                table.columns.name,
                column.label,
                backend.name,
                method.name,
                settings.time_step_s,
                settings.substeps,
                result.steps,
                result.is_cut ? 1 : 0,
                verdict,
                result.violation,
                is_in_bar ? 1 : 0,
                result.max_strain,
                result.end_strain,
                result.max_gain,
                result.end_gain,
                result.warnings,
                result.wall_s});
    std::printf("    %-52s %-9s strain %9.2g %9.2g  gain %9.2g %9.2g %6.2f s %s%s\n", cell.c_str(),
                verdict.c_str(), result.max_strain, result.end_strain, result.max_gain,
                result.end_gain, result.wall_s, is_in_bar ? "bar " : "", result.violation.c_str());
  }

  Bench& bench_;
  HangGuard guard_;
  Table table_;
  test::TrialLimits limits_;
};

}  // namespace

void MeasureStability(Bench& bench, const StabilityOptions& options) {
  AtlasForm form = options.is_full ? AtlasForm::kFull : AtlasForm::kShort;
  if (bench.is_quick()) form = AtlasForm::kThin;
  const std::vector<AtlasMethod> methods =
      Chosen(test::AtlasMethods(form), options.methods, "--methods");
  if (HasRandomTable(options.tables)) MeasureRandomCloths(bench, methods, options.is_full);
  if (!options.tables.empty() && AtlasNames(options.tables).empty()) return;
  Atlas atlas(bench, options);
  for (size_t k = 0; k < bench.backends().size(); ++k) {
    const std::vector<AtlasTable> tables =
        Chosen(test::AtlasTables(k == 0 ? form : AtlasForm::kThin), AtlasNames(options.tables),
               "--tables", std::string(" ") + kRandomTable);
    for (const AtlasMethod& method : methods) {
      if (k > 0 && !options.is_full && method.name != "REALTIME") continue;
      if (!atlas.Try(bench.backends()[k], method, tables)) return;
    }
  }
}

}  // namespace drape::bench
