// SPDX-License-Identifier: Apache-2.0
#include "runner.hpp"

#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "../../tools/common/check_values.hpp"
#include "csv.hpp"
#include "docs.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/core/text.hpp"
#include "html.hpp"
#include "kernels.hpp"
#include "runner_ledger.hpp"
#include "runner_scene.hpp"
#include "runner_system.hpp"
#include "skinning.hpp"
#include "sweep.hpp"
#include "table.hpp"
#include "table_targets.hpp"

namespace gsnav_report {

using namespace gsnav;

namespace {

Result<std::vector<SceneSpec>> scene_specs(const Options& o) {
  std::vector<SceneSpec> specs;
  for (const std::string& text : o.scenes) {
    Result<SceneSpec> spec = parse_scene(text);
    if (!spec) return spec.status();
    specs.push_back(std::move(*spec));
  }
  for (const std::string& ply : o.flats) {
    Result<SceneSpec> spec = benchmark_flat(ply);
    if (!spec) return spec.status();
    specs.push_back(std::move(*spec));
  }
  if (o.default_scene) specs.push_back(default_flat());
  std::map<std::string, SceneSpec*> names;
  for (SceneSpec& spec : specs) {
    if (!names.emplace(spec.name, &spec).second)
      return {Errc::invalid_argument, "two scenes are called " + spec.name};
  }
  for (const std::string& text : o.visible_sets) {
    if (std::error_code ignored; names.size() == 1 && std::filesystem::exists(text, ignored)) {
      specs.front().visible_sets = text;
      continue;
    }
    const std::size_t equals = text.find('=');
    const auto scene = names.find(text.substr(0, equals));
    if (equals == text.npos || scene == names.end()) {
      std::string known;
      for (const auto& [name, spec] : names) known.append(known.empty() ? "" : ", ").append(name);
      return {Errc::invalid_argument,
              "--visible-sets " + text + ": use [SCENE=]FILE; scenes are " + known};
    }
    scene->second->visible_sets = text.substr(equals + 1);
  }
  return specs;
}

PlanOptions plan_options(const Options& o, std::size_t views, int sh_degree, bool visible) {
  PlanOptions out{views,   o.sizes,   o.sensors,   o.backends, o.profiles,
                  o.knobs, o.oracles, o.knob_size, sh_degree,  o.knob_values};
  if (visible) out.profiles.emplace_back("visible");
  return out;
}

Status render_scenes(const Options& o, CsvFile& csv, const Row& stamp) {
  const Result<std::vector<SceneSpec>> specs = scene_specs(o);
  if (!specs) return specs.status();
  const ReferenceCache cache(o.cache);
  // A scene that is not loaded yet counts as one with the largest plan.
  const std::size_t each =
      plan(plan_options(o, static_cast<std::size_t>(o.views), 3, !o.visible_sets.empty())).size();
  std::size_t total = each * specs->size(), done = 0;
  Progress progress(total);
  for (const SceneSpec& spec : *specs) {
    const Result<Scene> scene = load(spec, o.views, o.frame);
    if (!scene) return scene.status();
    if (scene->views.empty()) {
      return {Errc::invalid_argument,
              "scene " + scene->name + " has nothing that views could surround: name its cameras"};
    }
    const std::vector<Setting> settings =
        plan(plan_options(o, scene->views.size(), scene->cloud.sh_degree, scene->visible.has_value()));
    progress.set_total(total -= each - settings.size());
    SceneRunner runner(o, *scene, cache, csv, stamp);
    for (const Setting& s : settings) {
      if (interrupted()) return csv.save();
      progress.show(done++, scene->name + " " + to_string(s.size) + " " + scene->views[s.view].name +
                                " " + s.backend + " " + s.profile +
                                (s.knob == "none" ? "" : " " + s.knob + " " + s.knob_value));
      if (Status status = runner.run(s); !status) {
        return {status.code(), "scene " + scene->name + ": " + status.message()};
      }
    }
    if (Status status = runner.save_worst_views(); !status) return status;
  }
  progress.finish();
  return {};
}

/// Adds rows of a kind that has no settings, unless the file already has the whole set of them.
Status add_rows(const Options& o, CsvFile& csv, const Row& stamp, const std::string& kind,
                const std::function<Result<std::vector<Row>>(const OnStep&)>& make) {
  if (!o.wants(kind) || interrupted()) return {};
  const std::string set = kind + " of " + stamp.get("commit") + " on " + stamp.get("machine");
  const auto key = [&](std::size_t i, std::size_t n) {
    return set + " " + (i + 1 == n ? std::string("end") : std::to_string(i));
  };
  if (csv.has(key(0, 1))) return {};
  std::fprintf(stderr, "%s rows\n", kind.c_str());
  Progress progress(0);
  bool shown = false;
  const Result<std::vector<Row>> rows =
      make([&](std::size_t done, std::size_t total, const std::string& what) {
        shown = true;
        progress.set_total(total);
        progress.show(done, what);
        return !interrupted();
      });
  if (shown) progress.finish();
  if (!rows) return rows.status();
  for (std::size_t i = 0; i < rows->size(); ++i) {
    if (csv.has(key(i, rows->size()))) continue;  // an interrupted run has added this row
    Row row = stamp;
    row.fill((*rows)[i]).set("key", key(i, rows->size()));
    if (Status s = csv.add(std::move(row)); !s) return s;
  }
  return {};
}

}  // namespace

Result<bool> run_report(const Options& o) {
  if (Status s = make_output_folder(o.out); !s) return Status(s.code(), "--out " + s.message());
  const std::filesystem::path out(o.out), path = out / "report.csv";
  if (Status s = gsnav_tools::check_files_in(out, {"report.html"}); !s) return s;
  if (Status s = o.docs.empty() ? Status() : check_output_path(o.docs); !s) return s;
  Result<CsvFile> csv = CsvFile::open(path, o.resume);
  if (!csv) return csv.status();
  Row stamp;
  stamp.set("machine", o.machine.empty() ? machine_name() : o.machine)
      .set("commit", o.commit)
      .set("date", today());

  watch_interrupts();
  if (Status s = add_rows(o, *csv, stamp, "ledger", [](const OnStep&) { return ledger_rows(); }); !s)
    return s;
  if (o.wants("render")) {
    if (Status s = render_scenes(o, *csv, stamp); !s) return s;
  }
  SkinningOptions skinning;
  skinning.threads = o.threads;
  skinning.runs = o.runs;
  if (Status s = add_rows(o, *csv, stamp, "skinning",
                          [&](const OnStep& on_step) {
                            skinning.on_step = on_step;
                            return skinning_rows(skinning);
                          });
      !s)
    return s;
  SweepOptions sweep;
  sweep.runs = o.runs;
  if (Status s = add_rows(o, *csv, stamp, "sweep",
                          [&](const OnStep& on_step) {
                            sweep.on_step = on_step;
                            return sweep_rows(sweep);
                          });
      !s)
    return s;
  if (!o.benchmarks.empty()) {
    if (Status s =
            add_rows(o, *csv, stamp, "kernel", [&](const OnStep&) { return kernel_rows(o.benchmarks); });
        !s)
      return s;
  }
  if (interrupted())
    std::fprintf(stderr, "\ninterrupted: %s holds the rows so far; --resume goes on\n",
                 gsnav::printable(path.string()).c_str());
  const Result<Table> table = Table::read(path);
  if (!table) return table.status();
  if (!o.no_html) {
    if (Status s = write_html(*table, out / "report.html", o.acceptance); !s) return s;
  }
  if (!o.docs.empty()) {
    if (Status s = write_docs(*table, o.docs); !s) return s;
  }
  if (o.acceptance) std::fputs(targets_text(check_targets(*table)).c_str(), stdout);
  std::printf("%zu rows in %s\n", csv->rows().size(), gsnav::printable(path.string()).c_str());
  return !interrupted();
}

}  // namespace gsnav_report
