"""Install by the README, again with a newer version and changed settings, and uninstall."""

from __future__ import annotations

import subprocess

from ..bench import INSTALL, Bench
from ..catalogue import Report, trial
from ..guest import UmlGuest
from ..image import put_source


@trial("the README's steps install it; the service starts, under the user ridelog, watched and confined")
def install(bench: Bench, report: Report) -> None:
    """A dry run, the real one, and what systemd says."""
    with UmlGuest(bench.new_folder("install-trial"), bench.image.disk) as guest:
        report.measure("boot, seconds to a shell", f"{guest.boot():.0f}")
        dry = guest.must(f"{INSTALL} --dry-run", 180)
        report.check("a dry run changes nothing", guest.run("ls /etc/ridelog").rc != 0)
        real = guest.must(INSTALL, 180)
        report.check("the real one does what the dry run said", dry == real, f"{len(real.splitlines())} steps")
        guest.must("for i in $(seq 120); do systemctl is-active ridelog && exit 0; sleep 1; done; exit 1", 180)
        show = guest.must("systemctl show ridelog -p Type,WatchdogUSec,User,Group,NRestarts,MainPID; "
                          "p=$(systemctl show ridelog -p MainPID --value); grep -E 'Seccomp:|NoNewPrivs|Groups' "
                          "/proc/$p/status; chrt -p $p; ls -l /proc/$p/task | wc -l")
        report.check("type, user, watchdog", all(word in show for word in ("Type=notify", "User=ridelog",
                                                                         "WatchdogUSec=30s", "NRestarts=0")))
        report.check("confined: no new privileges, a filter of system calls",
                     "NoNewPrivs:\t1" in show and "Seccomp:\t2" in show)
        report.check("real-time priority", "SCHED_RR" in show, show.strip().splitlines()[-2])
        exposure = guest.run("systemd-analyze security ridelog.service ridelog-export@x.service --no-pager 2>&1 | "
                             "grep -i overall; systemd-analyze security ridelog.service --no-pager | grep -i overall",
                             180).out
        report.measure("exposure by systemd-analyze security", " ".join(exposure.split())[:200])
        verified = guest.run("systemd-analyze verify /etc/systemd/system/ridelog.service "
                             "/etc/systemd/system/ridelog-export@.service 2>&1; udevadm verify "
                             "/etc/udev/rules.d/90-ridelog.rules 2>&1 | grep -v 'Unknown command' | head -3", 180).out
        report.check("systemd-analyze verify reports nothing", "ridelog" not in verified, verified[:300])


@trial("an upgrade in place keeps changed settings and puts the new ones beside them; the service goes on with its "
       "logs; uninstall takes away what install put there, and keeps logs and what was changed")
def upgrade_and_uninstall(bench: Bench, report: Report) -> None:
    """A version whose settings file differs, over one whose settings were changed by hand."""
    with bench.car("upgrade", chip="dump") as car:
        newer = car.guest.share / "newer"
        put_source(bench.tree, newer)
        settings = newer / "config/ridelog.yaml"
        settings.write_text(settings.read_text() + "# of the newer version\n")
        subprocess.run(["sed", "-i", 's/^version = .*/version = "9.9.9"/', newer / "pyproject.toml"], check=True)
        wheels = car.guest.share / "wheels"
        wheels.symlink_to(bench.work / "wheels-amd64")
        car.boot()
        car.wait_for_rows(3)
        car.guest.must("echo '# mine' >> /etc/ridelog/ridelog.yaml; cp -r /host/newer /root/newer; cd /root/newer && "
                       "/opt/ridelog/bin/pip install -q --no-index --no-deps --no-build-isolation "
                       "--find-links /root/wheels setuptools wheel >/dev/null 2>&1; "
                       "/opt/ridelog/bin/pip install -q --no-index --no-deps --find-links /root/wheels .", 900)
        out = car.guest.must(INSTALL, 300)
        report.check("changed settings stay", "# mine" in car.guest.must("cat /etc/ridelog/ridelog.yaml"))
        report.check("the new ones lie beside them", "newer version" in
                     car.guest.must("cat /etc/ridelog/ridelog.yaml.new"), out.splitlines()[1])
        car.wait_for("the newer version", "grep -q '9.9.9' /run/ridelog/status.json", 120)
        car.wait_for_rows(3)
        sessions = car.guest.must("ls /var/lib/ridelog/*.csv* | sed 's|.*/||; s/-.*//' | sort -u").split()
        report.check("it goes on with its logs", len(sessions) >= 2, sessions)
        rc = car.guest.run("systemctl stop ridelog; ridelog verify /var/lib/ridelog", 120)
        report.check("ridelog verify of the logs of both", rc.rc == 0, rc.out.splitlines()[0])
        car.guest.must("/opt/ridelog/bin/ridelog uninstall --dry-run && /opt/ridelog/bin/ridelog uninstall", 120)
        left = car.guest.run("ls /etc/systemd/system/ridelog* /etc/udev/rules.d/90-ridelog.rules "
                             "/etc/sysusers.d/ridelog.conf /usr/local/bin/ridelog 2>/dev/null; "
                             "ls /etc/ridelog").out.split()
        report.check("left after uninstall", left == ["ridelog.yaml"], left)
        report.check("the logs stay", int(car.guest.must("ls /var/lib/ridelog/*.csv | wc -l")) >= 2)
        report.check("the service is gone", car.guest.run("systemctl is-active ridelog").rc != 0)
