"""A process of your own: path.csv in, wrench.csv out; here a sheet on springs (part frame, SI units)."""

import numpy as np

STIFFNESS = 2e5  # [N/m]


def main() -> None:
    """Answer the path in the working folder."""
    path = np.genfromtxt("path.csv", delimiter=",", names=True)  # time, x, y, z, qx, qy, qz, qw
    wrench = np.zeros((len(path), 7))  # time, fx, fy, fz, mx, my, mz: on the tool, at the TCP
    wrench[:, 0] = path["time"]
    wrench[:, 3] = STIFFNESS * np.maximum(-path["z"], 0.0)
    header = "time,fx,fy,fz,mx,my,mz"
    np.savetxt("wrench.csv", wrench, delimiter=",", header=header, comments="", fmt="%.17g")
    print(f"largest force {wrench[:, 3].max():.1f} N")


if __name__ == "__main__":
    main()
