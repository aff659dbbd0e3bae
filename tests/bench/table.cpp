#include "tests/bench/table.h"

#include <cstdio>
#include <stdexcept>

#include "server/core/check.h"

namespace drape::bench {
namespace {

void WriteLine(std::ofstream& file, const std::vector<std::string>& texts) {
  for (size_t k = 0; k < texts.size(); ++k) file << (k == 0 ? "" : ",") << texts[k];
  file << '\n';
  file.flush();
}

}  // namespace

Cell::Cell(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", value);
  text_ = text;
}

Table::Table(const std::filesystem::path& path, const std::vector<std::string>& columns)
    : path_(path), column_count_(columns.size()), file_(path) {
  WriteLine(file_, columns);
  if (!file_.good()) throw std::runtime_error("cannot write " + path_.string());
}

void Table::Add(const std::vector<Cell>& cells) {
  DRAPE_CHECK(cells.size() == column_count_, path_.string() + ": one cell per column");
  std::vector<std::string> texts;
  for (const Cell& cell : cells) {
    DRAPE_CHECK(cell.text().find_first_of(",\"\n") == std::string::npos, "no quoting in tables");
    texts.push_back(cell.text());
  }
  WriteLine(file_, texts);
  if (!file_.good()) throw std::runtime_error("cannot write " + path_.string());
}

}  // namespace drape::bench
