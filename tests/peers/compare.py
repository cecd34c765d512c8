#!/usr/bin/env python3
"""nearfar's methods and Mitsuba 3 (path tracing, with and without Open Image Denoise) on one scene, in one table and chart.

A development tool, no part of the package; the makefile's `make peers SCENE=scene.toml REFERENCE=truth.exr` calls it. What it does:

1. makes a Python environment under target/peers with PyPI's mitsuba and pyoidn, and looks for the system's LLVM, which Mitsuba's fast
   variant compiles with (without it the scalar variant renders, which is slower: said on stderr);
2. `nearfar export SCENE` writes the scene for Mitsuba;
3. renders it at each number of samples as one process of its own, with the same thread count, box filter, no tone mapping; the denoiser gets
   colour, albedo and normals of the same samples;
4. calls `nearfar bench SCENE --methods` with every image as a --point.

Its seconds are user and system seconds of the whole Python process, start-up included, as for nearfar's own renders.
"""

import argparse
import glob
import os
import re
import resource
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PEERS = ROOT / "target" / "peers"
PACKAGES = ["numpy", "mitsuba", "pyoidn"]
# What Debian 12 and 13 and Ubuntu 24.04 package. Mitsuba 3.9 ends in an LLVM error with version 15.
LLVM_PACKAGES = ["libllvm19", "libllvm18"]
OLDEST_LLVM = 17


def say(text):
    print(f"peers: {text}", file=sys.stderr, flush=True)


def environment():
    """The Python of an environment that has the packages, made when missing."""
    folder = PEERS / "venv"
    python, stamp = folder / "bin" / "python", folder / "complete"
    if not stamp.is_file():
        say(f"installing {', '.join(PACKAGES)} into {folder}")
        shutil.rmtree(folder, ignore_errors=True)
        if subprocess.run([sys.executable, "-m", "venv", folder]).returncode:
            sys.exit("peers: python cannot make environments here: install its venv module (Debian: python3-venv)")
        subprocess.run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *PACKAGES], check=True)
        stamp.touch()
    return python


def newest_llvm():
    """The shared library of the newest LLVM of the system that will do, or None."""
    found = []
    for pattern in ["/usr/lib/*/libLLVM*.so*", "/usr/lib/llvm-*/lib/libLLVM*.so*", "/usr/lib*/libLLVM*.so*"]:
        for path in glob.glob(pattern):
            version = re.search(r"libLLVM(?:\.so\.|-)(\d+)", path)
            if version and int(version[1]) >= OLDEST_LLVM:
                found.append((int(version[1]), path))
    return max(found)[1] if found else None


def llvm():
    """As `newest_llvm`, installed when missing and possible."""
    path = newest_llvm()
    if path is None and shutil.which("apt-get") and os.geteuid() == 0:
        for package in LLVM_PACKAGES:
            say(f"installing {package}")
            if subprocess.run(["apt-get", "install", "-y", "-qq", "--no-install-recommends", package], stdout=subprocess.DEVNULL).returncode == 0:
                break
        path = newest_llvm()
    return path


def measured(command, env):
    """Runs a command; user and system seconds of it."""
    def used():
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    before = used()
    subprocess.run(command, check=True, env=env, stdout=subprocess.DEVNULL)
    return used() - before


def render(arguments):
    """In the process that is measured: renders one image."""
    import mitsuba

    mitsuba.set_variant(arguments.variant)
    import drjit
    import numpy

    # Scalar variants take their threads from here as well.
    drjit.set_thread_count(arguments.threads)
    scene = mitsuba.load_file(str(arguments.scene))
    integrator = scene.integrator()
    if arguments.denoise:
        aovs = {"type": "aov", "aovs": "albedo:albedo,normal:sh_normal", "image": integrator}
        integrator = mitsuba.load_dict(aovs)
    image = numpy.array(mitsuba.render(scene, integrator=integrator, spp=arguments.spp, seed=1), dtype=numpy.float32)
    color = numpy.ascontiguousarray(image[..., :3])
    if arguments.denoise:
        import pyoidn

        albedo, normal = (numpy.ascontiguousarray(image[..., i : i + 3]) for i in (image.shape[2] - 6, image.shape[2] - 3))
        color = pyoidn.denoise(numpy.maximum(color, 0.0), albedo=numpy.clip(albedo, 0.0, 1.0), normal=normal, hdr=True)
    mitsuba.Bitmap(color).write(str(arguments.output))


def compare(arguments):
    """The whole comparison."""
    scene = arguments.scene
    work = arguments.output or PEERS / scene.stem
    work.mkdir(parents=True, exist_ok=True)
    threads = arguments.threads or len(os.sched_getaffinity(0))
    python = environment()
    env = dict(os.environ, OIDN_NUM_THREADS=str(threads))
    variant, library = arguments.variant, llvm()
    if library:
        env["DRJIT_LIBLLVM_PATH"] = library
    elif variant.startswith("llvm"):
        say("no LLVM library here: rendering with scalar_rgb, which is slower than what this machine could do with LLVM installed")
        variant = "scalar_rgb"
    shared = [*(["--size", arguments.size] if arguments.size else []), *(x for s in arguments.set for x in ("--set", s))]
    xml = arguments.xml
    if xml is None:
        subprocess.run([arguments.nearfar, "export", scene, "-o", work / "export", *shared], check=True)
        xml = work / "export" / "scene.xml"

    def image(spp, denoise, output):
        command = [python, __file__, "--render", xml, "--spp", str(spp), "--variant", variant, "--threads", str(threads), "--output", output]
        return measured(command + (["--denoise"] if denoise else []), env)

    # Compiled kernels are kept by Mitsuba from run to run, and files by the system: the first run of each kind does not count.
    for denoise in (False, True):
        image(1, denoise, work / "warm.exr")
    points = []
    for denoise in (False, True):
        for spp in arguments.spp:
            name = f"mitsuba {spp} spp" + (" + OIDN" if denoise else "")
            output = work / (name.replace(" + ", "-").replace(" ", "-") + ".exr")
            seconds = image(spp, denoise, output)
            say(f"{name}: {seconds:.2f} s of CPU ({variant})")
            points += ["--point", f"{name},{seconds:.3f},{output}"]
    (work / "points.txt").write_text("\n".join(points[1::2]) + "\n")
    command = [arguments.nearfar, "bench", scene, "--methods", "--threads", str(threads), "--output", work / "bench", "--chart", work / "methods.svg"]
    command += [f"--json={work / 'methods.json'}", *shared, *points, *arguments.bench]
    if arguments.reference:
        command += ["--reference", arguments.reference]
    code = subprocess.run(command).returncode
    if code == 0:
        say(f"chart: {work / 'methods.svg'}; figures: {work / 'methods.json'}")
    sys.exit(code)


def main():
    own, bench = sys.argv[1:], []
    if "--" in own:
        at = own.index("--")
        own, bench = own[:at], own[at + 1 :]
    p = argparse.ArgumentParser(description=__doc__.split("\n")[0], epilog="What stands after -- goes to `nearfar bench`.")
    p.add_argument("scene", type=Path, help="scene that nearfar loads")
    p.add_argument("--reference", type=Path, help="ground truth (EXR), as for `nearfar bench`")
    p.add_argument("--nearfar", type=Path, default=ROOT / "target" / "release" / "nearfar", help="the program")
    p.add_argument("--output", type=Path, help="work folder; default target/peers/SCENE")
    p.add_argument("--spp", type=lambda t: [int(v) for v in t.split(",")], default=[4, 16, 64], help="samples per pixel, e.g. 4,16,64")
    p.add_argument("--threads", type=int, default=0, help="threads; default all")
    p.add_argument("--size", help="WxH, for both renderers")
    p.add_argument("--set", action="append", default=[], help="key=value, for both renderers")
    p.add_argument("--variant", default="llvm_ad_rgb", help="Mitsuba's variant")
    p.add_argument("--xml", type=Path, help="Mitsuba scene to render in place of an export")
    p.add_argument("--render", action="store_true", help=argparse.SUPPRESS)
    p.add_argument("--denoise", action="store_true", help=argparse.SUPPRESS)
    arguments = p.parse_args(own)
    arguments.bench = bench
    if arguments.render:
        arguments.spp = arguments.spp[0]
        render(arguments)
    else:
        compare(arguments)


if __name__ == "__main__":
    main()
