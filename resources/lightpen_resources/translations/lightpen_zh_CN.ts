<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="zh_CN" sourcelanguage="en">
<context>
    <name>About</name>
    <message>
        <source>About Lightpen</source>
        <translation>关于 Lightpen</translation>
    </message>
    <message>
        <source>Calibration of the probe tip of a light pen</source>
        <translation>光笔测头的标定</translation>
    </message>
    <message>
        <source>Lightpen: MIT licence. Qt, PySide6 and psycopg: LGPL 3. FFmpeg, which some installations of OpenCV contain: LGPL 2.1. Fonts: cut from Noto Sans and Noto Sans CJK, SIL Open Font License 1.1.</source>
        <translation>Lightpen：MIT 许可证。Qt、PySide6 和 psycopg：LGPL 3。FFmpeg（部分 OpenCV 安装包含）：LGPL 2.1。字体：取自 Noto Sans 和 Noto Sans CJK，SIL 开放字体许可证 1.1。</translation>
    </message>
    <message>
        <source>Open the log</source>
        <translation>打开日志</translation>
    </message>
</context>
<context>
    <name>ActionBar</name>
    <message>
        <source>Back</source>
        <translation>上一步</translation>
    </message>
</context>
<context>
    <name>ArchivePanel</name>
    <message>
        <source>Check the archive</source>
        <translation>检查档案库</translation>
    </message>
    <message>
        <source>Another operation is in progress.</source>
        <translation>另一项操作正在进行。</translation>
    </message>
    <message>
        <source>Read and compare every entry, record, result and image</source>
        <translation>读取并核对每个条目、记录、结果和图像</translation>
    </message>
    <message>
        <source>Save listed entries (CSV)...</source>
        <translation>保存所列条目 (CSV)...</translation>
    </message>
    <message>
        <source>Save entries</source>
        <translation>保存条目</translation>
    </message>
    <message>
        <source>{0} entries saved in {1}</source>
        <translation>{0} 个条目已保存到 {1}</translation>
    </message>
    <message>
        <source>For other programs</source>
        <translation>供其他程序使用</translation>
    </message>
    <message>
        <source>Entries not yet on the server; they are stored here and delivered when it responds. {0}</source>
        <translation>部分条目尚未送达服务器；已保存在本机，待服务器响应后送达。{0}</translation>
    </message>
    <message>
        <source>Delivering entries to the server</source>
        <translation>正在向服务器送交条目</translation>
    </message>
    <message>
        <source>{0} more findings</source>
        <translation>另有 {0} 处</translation>
    </message>
    <message>
        <source>Not checked since program start</source>
        <translation>程序启动后尚未检查</translation>
    </message>
    <message>
        <source>Changes detected. {0} entries and {1} files checked.</source>
        <translation>发现更改。已检查 {0} 个条目和 {1} 个文件。</translation>
    </message>
    <message>
        <source>No changes in {0} entries and {1} files</source>
        <translation>{0} 个条目和 {1} 个文件中未发现更改</translation>
    </message>
    <message>
        <source>The server has all entries.</source>
        <translation>服务器已收到全部条目。</translation>
    </message>
</context>
<context>
    <name>AssumptionsDialog</name>
    <message>
        <source>Default uncertainties of the station</source>
        <translation>工位的默认不确定度</translation>
    </message>
    <message>
        <source>Standard uncertainties (k = 1) used where the intrinsics file and the LED file state none. They apply from the next swing; its result marks the assumed values.</source>
        <translation>内参文件和 LED 文件未给出时采用的标准不确定度 (k = 1)。自下一次摆动起生效，结果中会标明假定值。</translation>
    </message>
    <message>
        <source>not measured</source>
        <translation>未测量</translation>
    </message>
    <message>
        <source>Focal length (other intrinsics scaled with it)</source>
        <translation>焦距（其他内参按比例确定）</translation>
    </message>
    <message>
        <source>Scale of the LED coordinates</source>
        <translation>LED 坐标的尺度</translation>
    </message>
    <message>
        <source>Form error of ball and cone</source>
        <translation>测球和锥孔的形状误差</translation>
    </message>
    <message>
        <source>Systematic error of LED centres</source>
        <translation>LED 中心的系统误差</translation>
    </message>
    <message>
        <source>Pen temperature during the swing</source>
        <translation>摆动时的光笔温度</translation>
    </message>
    <message>
        <source>Relative humidity (for the report)</source>
        <translation>相对湿度（用于报告）</translation>
    </message>
    <message>
        <source>Temperature difference from LED measurement (if not measured)</source>
        <translation>与测量 LED 时的温差（未测量温度时）</translation>
    </message>
    <message>
        <source>Default: {0}.</source>
        <translation>默认值：{0}。</translation>
    </message>
    <message>
        <source>Uncertainty of this temperature</source>
        <translation>该温度的标准不确定度</translation>
    </message>
    <message>
        <source>Thermal expansion of the pen</source>
        <translation>光笔的热膨胀系数</translation>
    </message>
</context>
<context>
    <name>BoardCalibration</name>
    <message>
        <source>Camera calibrated.</source>
        <translation>相机标定完成。</translation>
    </message>
    <message>
        <source>Saved and in use: {0}</source>
        <translation>已保存并使用：{0}</translation>
    </message>
</context>
<context>
    <name>BoardForm</name>
    <message>
        <source>Chessboard</source>
        <translation>棋盘格</translation>
    </message>
    <message>
        <source>Circles</source>
        <translation>圆点</translation>
    </message>
    <message>
        <source>Asymmetric circles</source>
        <translation>非对称圆点</translation>
    </message>
    <message>
        <source>Square</source>
        <translation>方格</translation>
    </message>
    <message>
        <source>Marker</source>
        <translation>标记</translation>
    </message>
    <message>
        <source>Distance</source>
        <translation>间距</translation>
    </message>
    <message>
        <source>Diameter</source>
        <translation>直径</translation>
    </message>
    <message>
        <source>Board</source>
        <translation>标定板</translation>
    </message>
    <message>
        <source>Dictionary</source>
        <translation>字典</translation>
    </message>
    <message>
        <source>Corners per row</source>
        <translation>每行角点数</translation>
    </message>
    <message>
        <source>Columns</source>
        <translation>列数</translation>
    </message>
    <message>
        <source>Corners per column</source>
        <translation>每列角点数</translation>
    </message>
    <message>
        <source>Rows</source>
        <translation>行数</translation>
    </message>
</context>
<context>
    <name>BoardWindow</name>
    <message>
        <source>Board images</source>
        <translation>标定板图像</translation>
    </message>
    <message>
        <source>{0}: RMS {1:.4f} px, cross-validated {2:.4f} px</source>
        <translation>{0}：均方根 {1:.4f} px，交叉验证 {2:.4f} px</translation>
    </message>
    <message>
        <source>Save intrinsics file</source>
        <translation>保存内参文件</translation>
    </message>
    <message>
        <source>Camera calibration</source>
        <translation>相机标定</translation>
    </message>
    <message>
        <source>From a folder...</source>
        <translation>从文件夹...</translation>
    </message>
    <message>
        <source>Calibrate</source>
        <translation>标定</translation>
    </message>
    <message>
        <source>Views (worst first)</source>
        <translation>视图（最差的在前）</translation>
    </message>
    <message>
        <source>Standard uncertainty of the projection of a point due to the intrinsics, over the image / px</source>
        <translation>由内参引起的投影点标准不确定度在图像上的分布 / px</translation>
    </message>
    <message>
        <source>Exclude view and recalibrate</source>
        <translation>剔除视图并重新标定</translation>
    </message>
    <message>
        <source>Waiting for the first image</source>
        <translation>正在等待第一幅图像</translation>
    </message>
    <message>
        <source>Start, then align the board with the outline.</source>
        <translation>开始后，请将标定板对准轮廓。</translation>
    </message>
    <message>
        <source>Views captured: {0}</source>
        <translation>已采集的视图：{0}</translation>
    </message>
    <message>
        <source>Another operation is in progress.</source>
        <translation>另一项操作正在进行。</translation>
    </message>
    <message>
        <source>Select a view.</source>
        <translation>请选择一幅视图。</translation>
    </message>
    <message>
        <source>Board not detected</source>
        <translation>未检测到标定板</translation>
    </message>
    <message>
        <source>Hold still.</source>
        <translation>请保持静止。</translation>
    </message>
    <message>
        <source>View captured. Align the board with the outline.</source>
        <translation>已采集。请将标定板对准轮廓。</translation>
    </message>
    <message>
        <source>Similar view already captured. Align the board with the outline.</source>
        <translation>已有类似的视图。请将标定板对准轮廓。</translation>
    </message>
    <message>
        <source>Residuals: RMS {0:.4f} px, cross-validated {1:.4f} px</source>
        <translation>残差：均方根 {0:.4f} px，交叉验证 {1:.4f} px</translation>
    </message>
    <message>
        <source>Projection uncertainty: RMS {0:.3f} px, max. {1:.3f} px</source>
        <translation>投影不确定度：均方根 {0:.3f} px，最大 {1:.3f} px</translation>
    </message>
    <message>
        <source>Residuals</source>
        <translation>残差</translation>
    </message>
    <message>
        <source>Uncertainty</source>
        <translation>不确定度</translation>
    </message>
    <message>
        <source>Save and use...</source>
        <translation>保存并使用...</translation>
    </message>
    <message>
        <source>Stop</source>
        <translation>停止</translation>
    </message>
    <message>
        <source>Start</source>
        <translation>开始</translation>
    </message>
    <message>
        <source>At least {0} views are needed.</source>
        <translation>至少需要 {0} 幅视图。</translation>
    </message>
    <message>
        <source>Calibrate first.</source>
        <translation>请先标定。</translation>
    </message>
</context>
<context>
    <name>BudgetFigure</name>
    <message>
        <source>combined</source>
        <translation>合成</translation>
    </message>
    <message>
        <source>limit {0}</source>
        <translation>限值 {0}</translation>
    </message>
    <message>
        <source>{0}, assumed</source>
        <translation>{0}，假定</translation>
    </message>
</context>
<context>
    <name>CameraPage</name>
    <message>
        <source>Camera</source>
        <translation>相机</translation>
    </message>
    <message>
        <source>Check that the LEDs are bright and in focus, that the intrinsics match this camera, and that there is no stray light.</source>
        <translation>检查 LED 是否明亮、对焦是否清晰，内参是否与相机相符，以及有无杂散光。</translation>
    </message>
    <message>
        <source>Camera connection lost. Reconnecting automatically.</source>
        <translation>相机连接中断，正在自动重连。</translation>
    </message>
    <message>
        <source>Continue to the LEDs</source>
        <translation>下一步：LED</translation>
    </message>
    <message>
        <source>No camera is open.</source>
        <translation>相机未打开。</translation>
    </message>
    <message>
        <source>A swing is in progress. Changing the source ends it; a change of intrinsics or mask applies from the next swing.</source>
        <translation>摆动正在进行。更换来源会结束摆动；更改内参或屏蔽从下一次摆动起生效。</translation>
    </message>
</context>
<context>
    <name>CameraSwitch</name>
    <message>
        <source>Camera {0}</source>
        <translation>相机 {0}</translation>
    </message>
</context>
<context>
    <name>ChecksPresenter</name>
    <message>
        <source>Pen</source>
        <translation>光笔</translation>
    </message>
    <message>
        <source>The scale by a certified value: {0:.4f} mm.</source>
        <translation>用证书值检查尺度：{0:.4f} mm。</translation>
    </message>
    <message>
        <source>Measure</source>
        <translation>测量</translation>
    </message>
</context>
<context>
    <name>DataFolderPanel</name>
    <message>
        <source>Data folder</source>
        <translation>数据文件夹</translation>
    </message>
    <message>
        <source>Open folder</source>
        <translation>打开文件夹</translation>
    </message>
    <message>
        <source>Open the data folder</source>
        <translation>打开数据文件夹</translation>
    </message>
    <message>
        <source>Location of swings and results</source>
        <translation>摆动记录和结果的保存位置</translation>
    </message>
    <message>
        <source>Save swings and results in another folder from the next start.</source>
        <translation>从下次启动起，将摆动记录和结果保存到其他文件夹。</translation>
    </message>
    <message>
        <source>Change...</source>
        <translation>更改...</translation>
    </message>
    <message>
        <source>Choose another data folder</source>
        <translation>选择其他数据文件夹</translation>
    </message>
</context>
<context>
    <name>DateField</name>
    <message>
        <source>Date, for example {0}; empty for any date</source>
        <translation>日期，例如 {0}；留空则不限</translation>
    </message>
</context>
<context>
    <name>DayControl</name>
    <message>
        <source>Check the camera</source>
        <translation>检查相机</translation>
    </message>
    <message>
        <source>Check the LEDs</source>
        <translation>检查 LED</translation>
    </message>
    <message>
        <source>Enter the temperature</source>
        <translation>输入温度</translation>
    </message>
    <message>
        <source>Verify the tip</source>
        <translation>验证测头</translation>
    </message>
</context>
<context>
    <name>DayPage</name>
    <message>
        <source>Tip {0}, pen {1}</source>
        <translation>测头 {0}，光笔 {1}</translation>
    </message>
    <message>
        <source>ball {0:g} mm</source>
        <translation>测球 {0:g} mm</translation>
    </message>
    <message>
        <source>cone {0}</source>
        <translation>锥孔 {0}</translation>
    </message>
    <message>
        <source>nominal {0} {1} {2} mm</source>
        <translation>标称 {0} {1} {2} mm</translation>
    </message>
    <message>
        <source>limit of U {0:g} mm</source>
        <translation>U 的限值 {0:g} mm</translation>
    </message>
    <message>
        <source>Practice</source>
        <translation>练习</translation>
    </message>
    <message>
        <source>{0} µm</source>
        <translation>{0} µm</translation>
    </message>
    <message>
        <source>due today</source>
        <translation>今天到期</translation>
    </message>
    <message>
        <source>due in {0} days</source>
        <translation>{0} 天后到期</translation>
    </message>
    <message>
        <source>The camera sends no images.</source>
        <translation>相机没有发送图像。</translation>
    </message>
    <message>
        <source>Camera</source>
        <translation>相机</translation>
    </message>
    <message>
        <source>Camera {0:.0f} fps</source>
        <translation>相机 {0:.0f} 幅/秒</translation>
    </message>
    <message>
        <source>LEDs fit to {0:.2f} px only, usual is {1:g} px.</source>
        <translation>LED 仅吻合到 {0:.2f} px，通常为 {1:g} px。</translation>
    </message>
    <message>
        <source>Pen {0} is overdue.</source>
        <translation>光笔 {0} 已过期。</translation>
    </message>
    <message>
        <source>LEDs of pen {0}</source>
        <translation>光笔 {0} 的 LED</translation>
    </message>
    <message>
        <source>Measure the temperature of the pen.</source>
        <translation>请测量光笔的温度。</translation>
    </message>
    <message>
        <source>No temperature</source>
        <translation>未给出温度</translation>
    </message>
    <message>
        <source>Pen at {0:.1f} °C</source>
        <translation>光笔温度 {0:.1f} °C</translation>
    </message>
    <message>
        <source>No drift reference</source>
        <translation>无漂移参考点</translation>
    </message>
    <message>
        <source>The camera moved. Verify the tip.</source>
        <translation>相机已移动。请验证测头。</translation>
    </message>
    <message>
        <source>Drift reference stable</source>
        <translation>漂移参考点稳定</translation>
    </message>
</context>
<context>
    <name>DayView</name>
    <message>
        <source>Camera</source>
        <translation>相机</translation>
    </message>
    <message>
        <source>LEDs</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>Drift reference</source>
        <translation>漂移参考点</translation>
    </message>
    <message>
        <source>Temperature</source>
        <translation>温度</translation>
    </message>
    <message>
        <source>Pen temperature today</source>
        <translation>今日光笔温度</translation>
    </message>
    <message>
        <source>not measured</source>
        <translation>未测量</translation>
    </message>
    <message>
        <source>Confirm</source>
        <translation>确认</translation>
    </message>
    <message>
        <source>Scan or type a tip</source>
        <translation>扫描或输入测头</translation>
    </message>
    <message>
        <source>Search tips</source>
        <translation>搜索测头</translation>
    </message>
    <message>
        <source>All tips</source>
        <translation>所有测头</translation>
    </message>
    <message>
        <source>Due tips</source>
        <translation>到期的测头</translation>
    </message>
    <message>
        <source>Tips shown</source>
        <translation>显示的测头</translation>
    </message>
    <message>
        <source>Tips of this station</source>
        <translation>本工位的测头</translation>
    </message>
    <message>
        <source>Tip</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>Pen</source>
        <translation>光笔</translation>
    </message>
    <message>
        <source>Due</source>
        <translation>到期</translation>
    </message>
    <message>
        <source>U (k = 2)</source>
        <translation>U (k = 2)</translation>
    </message>
    <message>
        <source>Calibrated</source>
        <translation>标定时间</translation>
    </message>
    <message>
        <source>Verdict</source>
        <translation>结论</translation>
    </message>
    <message>
        <source>Swing anyway</source>
        <translation>仍然摆动</translation>
    </message>
    <message>
        <source>Set up station...</source>
        <translation>设置工位…</translation>
    </message>
    <message>
        <source>Swing tip {0}</source>
        <translation>摆动测头 {0}</translation>
    </message>
    <message>
        <source>Choose a tip in the table, or clear the search.</source>
        <translation>请在表中选择测头，或清除搜索内容。</translation>
    </message>
    <message>
        <source>No tip matches {0}. Press Enter, or clear the search.</source>
        <translation>没有与 {0} 匹配的测头。请按回车键，或清除搜索内容。</translation>
    </message>
</context>
<context>
    <name>Demo</name>
    <message>
        <source>Demo ended: no tip to accept.</source>
        <translation>演示结束：没有可接受的测头。</translation>
    </message>
    <message>
        <source>Demo: enter station, pen, tip and cone.</source>
        <translation>演示：填写工位、光笔、测头和锥孔。</translation>
    </message>
    <message>
        <source>Demo: check exposure, focus and intrinsics of the simulated camera.</source>
        <translation>演示：检查模拟相机的曝光、对焦和内参。</translation>
    </message>
    <message>
        <source>Demo: compare the LED file with the image.</source>
        <translation>演示：将 LED 文件与图像比较。</translation>
    </message>
    <message>
        <source>Demo: the simulated operator seats the tip and follows the arrow. No key is needed up to the verdict.</source>
        <translation>演示：模拟操作员将测头就位并跟随箭头。到得出结论为止无需按键。</translation>
    </message>
    <message>
        <source>Demo: review the tip and its uncertainty.</source>
        <translation>演示：复核测头及其不确定度。</translation>
    </message>
    <message>
        <source>Demo: the simulated operator measures a plate of ten features.</source>
        <translation>演示：模拟操作员测量一块含十个要素的平板。</translation>
    </message>
    <message>
        <source>Tip accepted. Demo data is not saved.</source>
        <translation>测头已接受。演示数据不会保存。</translation>
    </message>
    <message>
        <source>Demo finished. You can look around; demo data is not saved. To calibrate a tip, start the program without the demo.</source>
        <translation>演示结束。您可以随意查看；演示数据不会保存。要标定测头，请不带演示启动程序。</translation>
    </message>
</context>
<context>
    <name>DiscoveryWindow</name>
    <message>
        <source>Find pen and camera</source>
        <translation>求光笔和相机</translation>
    </message>
    <message>
        <source>No image</source>
        <translation>无图像</translation>
    </message>
    <message>
        <source>Save both files and calibrate the tip</source>
        <translation>保存两个文件并标定测头</translation>
    </message>
    <message>
        <source>Not specified</source>
        <translation>未指定</translation>
    </message>
    <message>
        <source>Disc diameter</source>
        <translation>圆盘直径</translation>
    </message>
    <message>
        <source>Stop</source>
        <translation>停止</translation>
    </message>
    <message>
        <source>Start</source>
        <translation>开始</translation>
    </message>
    <message>
        <source>Swing the pen first.</source>
        <translation>请先摆动光笔。</translation>
    </message>
    <message>
        <source>Tip {0}: {1:.4f} ± {2:.4f} mm (k = 2)</source>
        <translation>测头 {0}：{1:.4f} ± {2:.4f} mm (k = 2)</translation>
    </message>
    <message>
        <source>Focal length: {0:.2f} ± {1:.2f} px (k = 2)</source>
        <translation>焦距：{0:.2f} ± {1:.2f} px (k = 2)</translation>
    </message>
    <message>
        <source>Find pen and camera first.</source>
        <translation>请先求光笔和相机。</translation>
    </message>
    <message>
        <source>Distance of the LEDs</source>
        <translation>LED 间距</translation>
    </message>
    <message>
        <source>U (k = 2) of distance</source>
        <translation>间距的 U (k = 2)</translation>
    </message>
    <message>
        <source>Images: {0} of {1}</source>
        <translation>图像：{0} / {1}</translation>
    </message>
    <message>
        <source>Enter the distance of the LEDs.</source>
        <translation>请输入 LED 间距。</translation>
    </message>
    <message>
        <source>Computing</source>
        <translation>正在计算</translation>
    </message>
    <message>
        <source>U of the tip is {0:.3f} mm; the limit is {1:g} mm. Swing again with more images and tilt, or measure the length better.</source>
        <translation>测头的 U 为 {0:.3f} mm，限值为 {1:g} mm。请以更多图像和更大倾斜重新摆动，或更准确地测量该长度。</translation>
    </message>
    <message>
        <source>Pen and camera found. The image shows the projection uncertainty / px.</source>
        <translation>已求得光笔和相机。图中为投影不确定度 / px。</translation>
    </message>
    <message>
        <source>Enter the distance between the two marked LEDs.</source>
        <translation>请输入两个所标 LED 之间的距离。</translation>
    </message>
    <message>
        <source>Check the length, and compute pen and camera.</source>
        <translation>请核对长度，然后计算光笔和相机。</translation>
    </message>
    <message>
        <source>Lock zoom, focus and exposure. Seat the tip in the cone, hold the LEDs towards the camera, and press Start.</source>
        <translation>锁定变焦、对焦和曝光。将测头放入锥孔，LED 朝向相机，然后按“开始”。</translation>
    </message>
    <message>
        <source>Swing the pen slowly: tilt it by 30 degrees in all directions, and turn it about its axis.</source>
        <translation>缓慢摆动光笔：向各方向倾斜 30 度，并绕其轴线转动。</translation>
    </message>
    <message>
        <source>All directions are covered. Keep swinging and turning.</source>
        <translation>各方向均已覆盖。请继续摆动和转动。</translation>
    </message>
    <message>
        <source>Tilt and turn the pen as the arrow shows.</source>
        <translation>按箭头所示倾斜并转动光笔。</translation>
    </message>
    <message>
        <source>Measure LEDs {0} and {1}, the marked ones, from centre to centre: with a caliper over the outer edges of both discs, minus one disc diameter. Measure at the temperature of the swing.</source>
        <translation>测量所标 LED {0} 与 {1} 的中心距：用卡尺测两圆盘外缘之间的尺寸，再减去一个圆盘直径。请在摆动时的温度下测量。</translation>
    </message>
    <message>
        <source>LEDs: {0}, U (k = 2) up to {1:.1f} µm</source>
        <translation>LED：{0} 个，U (k = 2) 最大 {1:.1f} µm</translation>
    </message>
    <message>
        <source>Images used: {0} of {1}, noise {2:.3f} px</source>
        <translation>使用图像：{0} / {1}，噪声 {2:.3f} px</translation>
    </message>
</context>
<context>
    <name>DuePanel</name>
    <message>
        <source>{0} of {1} tips in use at this station are due.</source>
        <translation>本工位使用中的 {1} 个测头中，{0} 个已到期。</translation>
    </message>
    <message>
        <source>No tip is in use at this station.</source>
        <translation>本工位没有正在使用的测头。</translation>
    </message>
    <message>
        <source>Calibrated</source>
        <translation>标定日期</translation>
    </message>
    <message>
        <source>Due</source>
        <translation>到期</translation>
    </message>
    <message>
        <source>State</source>
        <translation>状态</translation>
    </message>
    <message>
        <source>DUE</source>
        <translation>已到期</translation>
    </message>
    <message>
        <source>valid</source>
        <translation>未到期</translation>
    </message>
</context>
<context>
    <name>EntryPanel</name>
    <message>
        <source>Cancel</source>
        <translation>取消</translation>
    </message>
    <message>
        <source>Comment on this entry. It cannot be changed later.</source>
        <translation>对该条目的备注，录入后不能更改。</translation>
    </message>
    <message>
        <source>Comment</source>
        <translation>备注</translation>
    </message>
    <message>
        <source>Add</source>
        <translation>添加</translation>
    </message>
    <message>
        <source>Entry {0} was modified after it was entered and is not reliable. Restore the archive from a copy.</source>
        <translation>条目 {0} 在录入后被更改，不可信。请用副本恢复档案库。</translation>
    </message>
    <message>
        <source>Add comment...</source>
        <translation>添加备注...</translation>
    </message>
    <message>
        <source>Select an entry.</source>
        <translation>请选择一个条目。</translation>
    </message>
    <message>
        <source>Add a comment</source>
        <translation>添加备注</translation>
    </message>
    <message>
        <source>Verification report...</source>
        <translation>验证报告…</translation>
    </message>
    <message>
        <source>Calibration report...</source>
        <translation>标定报告...</translation>
    </message>
    <message>
        <source>Preview, save as PDF, or print</source>
        <translation>预览、另存为 PDF 或打印</translation>
    </message>
    <message>
        <source>No entry selected</source>
        <translation>未选择条目</translation>
    </message>
    <message>
        <source>Entry {0}, {1}, SHA-256 {2}</source>
        <translation>条目 {0}，{1}，SHA-256 {2}</translation>
    </message>
    <message>
        <source>Station {0}</source>
        <translation>工位 {0}</translation>
    </message>
    <message>
        <source>Operator {0}</source>
        <translation>操作员 {0}</translation>
    </message>
    <message>
        <source>Only accepted tips and verifications have a report.</source>
        <translation>只有已接受的测头和验证才有报告。</translation>
    </message>
    <message>
        <source>Pen {0}</source>
        <translation>光笔 {0}</translation>
    </message>
    <message>
        <source>Tip {0}</source>
        <translation>测头 {0}</translation>
    </message>
    <message>
        <source>Cone {0}</source>
        <translation>锥孔 {0}</translation>
    </message>
</context>
<context>
    <name>ExposurePanel</name>
    <message>
        <source>E&amp;xposure</source>
        <translation>曝光(&amp;X)</translation>
    </message>
    <message>
        <source>Exposure</source>
        <translation>曝光</translation>
    </message>
    <message>
        <source>&amp;Gain</source>
        <translation>增益(&amp;G)</translation>
    </message>
    <message>
        <source>Gain</source>
        <translation>增益</translation>
    </message>
    <message>
        <source>No LED detected</source>
        <translation>未检测到 LED</translation>
    </message>
    <message>
        <source>Saturated: {0} of {1} LEDs</source>
        <translation>饱和：{1} 个 LED 中有 {0} 个</translation>
    </message>
    <message>
        <source>Saturated: {0} of {1} spots</source>
        <translation>饱和：{1} 个光点中有 {0} 个</translation>
    </message>
    <message>
        <source>Too dark: {0} of {1} LEDs</source>
        <translation>过暗：{1} 个 LED 中有 {0} 个</translation>
    </message>
    <message>
        <source>Too dark: {0} of {1} spots</source>
        <translation>过暗：{1} 个光点中有 {0} 个</translation>
    </message>
    <message>
        <source>OK: {0} LEDs</source>
        <translation>合适：{0} 个 LED</translation>
    </message>
    <message>
        <source>OK: {0} spots</source>
        <translation>合适：{0} 个光点</translation>
    </message>
    <message>
        <source>Up and Down keys change the value; Enter applies a typed number.</source>
        <translation>用上下键调整；输入数值后按 Enter。</translation>
    </message>
    <message>
        <source>{0:.0%} to {1:.0%} of full scale</source>
        <translation>满量程的 {0:.0%} 至 {1:.0%}</translation>
    </message>
    <message>
        <source>LED {0}: {1} %</source>
        <translation>LED {0}：{1} %</translation>
    </message>
    <message>
        <source>Auto exposure (LEDs)</source>
        <translation>自动曝光（按 LED）</translation>
    </message>
    <message>
        <source>Sets exposure and gain so that the brightest LED reaches 80 % of full scale.</source>
        <translation>设定曝光和增益，使最亮的 LED 达到满量程的 80 %。</translation>
    </message>
    <message>
        <source>No images are received.</source>
        <translation>没有收到图像。</translation>
    </message>
    <message>
        <source>Recorded images: exposure and gain are fixed.</source>
        <translation>录制的图像：曝光和增益固定。</translation>
    </message>
    <message>
        <source>Exposure set. Brightest LED: {0}; none saturated.</source>
        <translation>曝光已设定。最亮的 LED：{0}，没有 LED 饱和。</translation>
    </message>
    <message>
        <source>No LEDs detected. Hold the pen in view of the camera.</source>
        <translation>未检测到 LED。请将光笔置于相机视野内。</translation>
    </message>
    <message>
        <source>Image too bright at minimum exposure and gain ({0}). Close the aperture.</source>
        <translation>曝光和增益已最小，图像仍过亮（{0}）。请调小光圈。</translation>
    </message>
    <message>
        <source>LEDs reach only {0}; a longer exposure would blur the moving pen. Open the aperture.</source>
        <translation>LED 只能达到 {0}；再延长曝光会使移动的光笔模糊。请调大光圈。</translation>
    </message>
    <message>
        <source>Brightness varies from image to image ({0}). Hold the pen still and check the LED power supply.</source>
        <translation>各图像亮度不一致（{0}）。请保持光笔不动，并检查 LED 供电。</translation>
    </message>
    <message>
        <source>Hold the pen with its LEDs facing the camera.</source>
        <translation>请将光笔的 LED 朝向相机。</translation>
    </message>
    <message>
        <source>All LEDs are correctly exposed.</source>
        <translation>所有 LED 曝光合适。</translation>
    </message>
    <message>
        <source>Lengthen the exposure until all LEDs are OK.</source>
        <translation>延长曝光，直到所有 LED 都合适。</translation>
    </message>
    <message>
        <source>Raise the gain: a longer exposure would blur the moving pen.</source>
        <translation>提高增益：再延长曝光会使移动的光笔模糊。</translation>
    </message>
    <message>
        <source>LED brightness differs too much. Clean the LEDs and check their power supply.</source>
        <translation>各 LED 亮度相差过大。请清洁 LED，并检查供电。</translation>
    </message>
    <message>
        <source>Record the images again with a shorter exposure.</source>
        <translation>请用更短的曝光重新录制图像。</translation>
    </message>
    <message>
        <source>Record the images again with a longer exposure.</source>
        <translation>请用更长的曝光重新录制图像。</translation>
    </message>
    <message>
        <source>Close the aperture slightly.</source>
        <translation>请将光圈略微调小。</translation>
    </message>
    <message>
        <source>Open the aperture slightly.</source>
        <translation>请将光圈略微调大。</translation>
    </message>
    <message>
        <source>Stop</source>
        <translation>停止</translation>
    </message>
    <message>
        <source>Hold the pen still. Brightest LED: {0}</source>
        <translation>请保持光笔不动。最亮的 LED：{0}</translation>
    </message>
    <message>
        <source>Lower the gain until no LED is saturated.</source>
        <translation>降低增益，直到没有 LED 饱和。</translation>
    </message>
    <message>
        <source>Shorten the exposure until no LED is saturated.</source>
        <translation>缩短曝光，直到没有 LED 饱和。</translation>
    </message>
</context>
<context>
    <name>FilesOfCameras</name>
    <message>
        <source>{0} is the intrinsics file of camera {1}, not of camera {2}. Open the file of this camera.</source>
        <translation>{0} 是相机 {1} 的内参文件，不是相机 {2} 的。请打开此相机的文件。</translation>
    </message>
</context>
<context>
    <name>FilterBar</name>
    <message>
        <source>Pen</source>
        <translation>光笔</translation>
    </message>
    <message>
        <source>Tip</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>Station</source>
        <translation>工位</translation>
    </message>
    <message>
        <source>From</source>
        <translation>从</translation>
    </message>
    <message>
        <source>To</source>
        <translation>至</translation>
    </message>
    <message>
        <source>Entry type</source>
        <translation>类型</translation>
    </message>
    <message>
        <source>any day</source>
        <translation>任意日期</translation>
    </message>
    <message>
        <source>All</source>
        <translation>全部</translation>
    </message>
</context>
<context>
    <name>FocusPanel</name>
    <message>
        <source>No LED detected</source>
        <translation>未检测到 LED</translation>
    </message>
    <message>
        <source>Saturated</source>
        <translation>饱和</translation>
    </message>
    <message>
        <source>In focus</source>
        <translation>对焦清晰</translation>
    </message>
    <message>
        <source>Out of focus</source>
        <translation>对焦不准</translation>
    </message>
    <message>
        <source>{0:.1f} px, best {1:.1f} px</source>
        <translation>{0:.1f} px，最佳 {1:.1f} px</translation>
    </message>
    <message>
        <source>Recorded images: focus is fixed.</source>
        <translation>录制的图像：对焦固定。</translation>
    </message>
    <message>
        <source>Reduce the exposure first: saturated LEDs give no edge width.</source>
        <translation>请先降低曝光：LED 饱和时无法得到边缘宽度。</translation>
    </message>
    <message>
        <source>Turn the focus ring until the edge width is smallest.</source>
        <translation>转动对焦环，使边缘宽度最小。</translation>
    </message>
    <message>
        <source>Edge width of the LEDs from dark to bright. Hold the pen still.</source>
        <translation>LED 边缘由暗到亮的宽度。请保持光笔不动。</translation>
    </message>
</context>
<context>
    <name>FramePanel</name>
    <message>
        <source>Pen and pen frame</source>
        <translation>光笔及光笔坐标系</translation>
    </message>
</context>
<context>
    <name>HelpWindow</name>
    <message>
        <source>Help</source>
        <translation>帮助</translation>
    </message>
</context>
<context>
    <name>HistoryModel</name>
    <message>
        <source>When</source>
        <translation>时间</translation>
    </message>
    <message>
        <source>Station</source>
        <translation>工位</translation>
    </message>
    <message>
        <source>Pen</source>
        <translation>光笔</translation>
    </message>
    <message>
        <source>Tip</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>Verdict</source>
        <translation>结论</translation>
    </message>
    <message>
        <source>Entry type</source>
        <translation>类型</translation>
    </message>
    <message>
        <source>x / mm</source>
        <translation>x / mm</translation>
    </message>
    <message>
        <source>y / mm</source>
        <translation>y / mm</translation>
    </message>
    <message>
        <source>z / mm</source>
        <translation>z / mm</translation>
    </message>
    <message>
        <source>U / mm</source>
        <translation>U / mm</translation>
    </message>
    <message>
        <source>Operator</source>
        <translation>操作员</translation>
    </message>
    <message>
        <source>Notes</source>
        <translation>说明</translation>
    </message>
</context>
<context>
    <name>HistoryPage</name>
    <message>
        <source>History</source>
        <translation>历史</translation>
    </message>
    <message>
        <source>Trend</source>
        <translation>趋势</translation>
    </message>
    <message>
        <source>Entry</source>
        <translation>条目</translation>
    </message>
    <message>
        <source>Due</source>
        <translation>到期</translation>
    </message>
    <message>
        <source>Archive</source>
        <translation>档案库</translation>
    </message>
    <message>
        <source>Complete, tamper-evident history of every tip</source>
        <translation>每个测头的完整历史，任何篡改均可察觉</translation>
    </message>
    <message>
        <source>Next calibration</source>
        <translation>下一次标定</translation>
    </message>
    <message>
        <source>1 entry</source>
        <translation>1 条记录</translation>
    </message>
    <message>
        <source>{0} entries</source>
        <translation>{0} 个条目</translation>
    </message>
    <message>
        <source>Saved in {0}</source>
        <translation>已保存到 {0}</translation>
    </message>
</context>
<context>
    <name>HistoryTable</name>
    <message>
        <source>Archive entries (newest first)</source>
        <translation>档案库条目（最新的在前）</translation>
    </message>
</context>
<context>
    <name>ImageModel</name>
    <message>
        <source>Image</source>
        <translation>图像</translation>
    </message>
    <message>
        <source>RMS / px</source>
        <translation>均方根 / px</translation>
    </message>
    <message>
        <source>LEDs</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>State</source>
        <translation>状态</translation>
    </message>
    <message>
        <source>included</source>
        <translation>已计入</translation>
    </message>
    <message>
        <source>excluded</source>
        <translation>已剔除</translation>
    </message>
</context>
<context>
    <name>ImageTable</name>
    <message>
        <source>Images (worst first)</source>
        <translation>图像（最差的在前）</translation>
    </message>
</context>
<context>
    <name>ImageView</name>
    <message>
        <source>Live image</source>
        <translation>实时图像</translation>
    </message>
</context>
<context>
    <name>ImagesPanel</name>
    <message>
        <source>image</source>
        <translation>图像</translation>
    </message>
    <message>
        <source>Exclude</source>
        <translation>剔除</translation>
    </message>
    <message>
        <source>Include</source>
        <translation>恢复</translation>
    </message>
    <message>
        <source>RMS / px (x: excluded)</source>
        <translation>均方根 / px（×：已排除）</translation>
    </message>
    <message>
        <source>{0} {1}</source>
        <translation>{1} {0} 幅</translation>
    </message>
    <message>
        <source>; </source>
        <translation>；</translation>
    </message>
    <message>
        <source>No image is selected.</source>
        <translation>未选择图像。</translation>
    </message>
    <message>
        <source>Already excluded</source>
        <translation>已剔除</translation>
    </message>
    <message>
        <source>Exclude the selected images and recompute (Delete)</source>
        <translation>剔除所选图像并重新计算（Delete）</translation>
    </message>
    <message>
        <source>Include the selected images and recompute (Insert)</source>
        <translation>恢复所选图像并重新计算（Insert）</translation>
    </message>
    <message>
        <source>Already included</source>
        <translation>已计入</translation>
    </message>
    <message>
        <source>Excluded automatically: {0}</source>
        <translation>自动剔除：{0}</translation>
    </message>
    <message>
        <source>Image {0}, residuals × {1}</source>
        <translation>图像 {0}，残差 × {1}</translation>
    </message>
    <message>
        <source>Image {0}: pen not found. {1}</source>
        <translation>图像 {0}：未找到光笔。{1}</translation>
    </message>
    <message>
        <source>Image not available</source>
        <translation>无法显示该图像</translation>
    </message>
</context>
<context>
    <name>InterruptedControl</name>
    <message>
        <source>Reading the verification</source>
        <translation>正在读取验证</translation>
    </message>
    <message>
        <source>Closing the verification</source>
        <translation>正在结束验证</translation>
    </message>
    <message>
        <source>Verification closed as abandoned. See History.</source>
        <translation>验证已作为放弃结束。见“历史”。</translation>
    </message>
</context>
<context>
    <name>InterruptedPanel</name>
    <message>
        <source>A resumed swing keeps its images and its files.</source>
        <translation>继续时保留全部图像和原来的文件。</translation>
    </message>
    <message>
        <source>Search again</source>
        <translation>重新查找</translation>
    </message>
    <message>
        <source>Keep</source>
        <translation>保留</translation>
    </message>
    <message>
        <source>In use by another program</source>
        <translation>另一程序正在使用</translation>
    </message>
    <message>
        <source>Damaged: {0}</source>
        <translation>已损坏：{0}</translation>
    </message>
    <message>
        <source>Discard this swing? Its images remain on the disk.</source>
        <translation>放弃这次摆动吗？图像保留在磁盘上。</translation>
    </message>
    <message>
        <source>Resume</source>
        <translation>继续</translation>
    </message>
    <message>
        <source>Resume the swing of {0}</source>
        <translation>继续 {0} 的摆动</translation>
    </message>
    <message>
        <source>Discard</source>
        <translation>放弃</translation>
    </message>
    <message>
        <source>Discard the swing of {0}</source>
        <translation>放弃 {0} 的摆动</translation>
    </message>
    <message>
        <source>Reading the swing</source>
        <translation>正在读取摆动</translation>
    </message>
    <message>
        <source>No camera is open. Choose the image source of this swing at the step Camera: {0}. Then resume the swing here.</source>
        <translation>没有打开相机。请在“相机”步骤选择该摆动的图像来源：{0}，再回到这里继续摆动。</translation>
    </message>
    <message>
        <source>The swing was captured with another image source: {0}. Choose that source at the step Camera, then resume the swing here.</source>
        <translation>该摆动由另一图像来源采集：{0}。请在“相机”步骤选择该来源，再回到这里继续摆动。</translation>
    </message>
    <message>
        <source>The image size is {0} x {1} px; the swing was captured with {2} x {3} px. Choose its camera at the step Camera, then resume the swing here.</source>
        <translation>图像尺寸为 {0} × {1} px，该摆动采集时为 {2} × {3} px。请在“相机”步骤选择当时的相机，再回到这里继续摆动。</translation>
    </message>
    <message>
        <source>Discarding the swing</source>
        <translation>正在放弃摆动</translation>
    </message>
    <message>
        <source>Swing discarded. The images remain in {0}.</source>
        <translation>摆动已放弃。图像保留在 {0}。</translation>
    </message>
    <message>
        <source>Interrupted: {0}</source>
        <translation>中断的项目：{0}</translation>
    </message>
</context>
<context>
    <name>IntrinsicsPanel</name>
    <message>
        <source>Intrinsics of camera and lens</source>
        <translation>相机与镜头的内参</translation>
    </message>
    <message>
        <source>Intrinsics files ({0})</source>
        <translation>内参文件 ({0})</translation>
    </message>
    <message>
        <source>Intrinsics file</source>
        <translation>内参文件</translation>
    </message>
    <message>
        <source>Open...</source>
        <translation>打开...</translation>
    </message>
    <message>
        <source>Binned or cropped images...</source>
        <translation>合并或裁剪的图像...</translation>
    </message>
    <message>
        <source>Calibrate camera...</source>
        <translation>标定相机...</translation>
    </message>
    <message>
        <source>I have no such file...</source>
        <translation>我没有此文件...</translation>
    </message>
    <message>
        <source>Find pen, camera and tip by one swing and one length.</source>
        <translation>由一次摆动和一个长度求光笔、相机和测头。</translation>
    </message>
    <message>
        <source>In use</source>
        <translation>使用中</translation>
    </message>
    <message>
        <source>Focal lengths</source>
        <translation>焦距</translation>
    </message>
    <message>
        <source>Principal point</source>
        <translation>主点</translation>
    </message>
    <message>
        <source>Distortion</source>
        <translation>畸变</translation>
    </message>
    <message>
        <source>Calibrated</source>
        <translation>标定日期</translation>
    </message>
    <message>
        <source>Open the intrinsics file of this camera and lens.</source>
        <translation>请打开此相机与镜头的内参文件。</translation>
    </message>
    <message>
        <source>Image size of the file: {0}</source>
        <translation>文件的图像尺寸：{0}</translation>
    </message>
    <message>
        <source>Size fits: {0}. Checked against the pen at step LEDs.</source>
        <translation>尺寸相符：{0}。将在 LED 步骤中与光笔核对。</translation>
    </message>
    <message>
        <source>Image size is {0}; the intrinsics file is for {1}. Choose the file of this camera, or say how the images are binned or cropped.</source>
        <translation>图像尺寸为 {0}；内参文件适用于 {1}。请选择这台相机的文件，或说明图像如何合并像素或裁剪。</translation>
    </message>
    <message>
        <source>Checked by a swing: file and camera agree.</source>
        <translation>已由摆动检查：文件与相机一致。</translation>
    </message>
    <message>
        <source>No date</source>
        <translation>无日期</translation>
    </message>
    <message>
        <source>, no uncertainty in the file</source>
        <translation>，文件未给出不确定度</translation>
    </message>
    <message>
        <source>{0} and {1} px</source>
        <translation>{0} 和 {1} px</translation>
    </message>
    <message>
        <source>{0} and {1} px (k = 2)</source>
        <translation>{0} 和 {1} px (k = 2)</translation>
    </message>
    <message>
        <source>{0} x {1}</source>
        <translation>{0} × {1}</translation>
    </message>
</context>
<context>
    <name>ItemButton</name>
    <message>
        <source>Tip library...</source>
        <translation>测头库...</translation>
    </message>
    <message>
        <source>Choose...</source>
        <translation>选择...</translation>
    </message>
</context>
<context>
    <name>ItemForm</name>
    <message>
        <source>Not specified</source>
        <translation>未指定</translation>
    </message>
    <message>
        <source>As for the station</source>
        <translation>按工位设定</translation>
    </message>
    <message>
        <source>ID (as on label)</source>
        <translation>编号（与标签一致）</translation>
    </message>
    <message>
        <source>Expiry date</source>
        <translation>有效期至</translation>
    </message>
    <message>
        <source>Certificate number</source>
        <translation>证书编号</translation>
    </message>
    <message>
        <source>Date of the certificate</source>
        <translation>证书日期</translation>
    </message>
    <message>
        <source>Certified value</source>
        <translation>证书值</translation>
    </message>
    <message>
        <source>Shape</source>
        <translation>形状</translation>
    </message>
    <message>
        <source>U (k = 2) of the value</source>
        <translation>该值的 U（k = 2）</translation>
    </message>
    <message>
        <source>Contact</source>
        <translation>接触</translation>
    </message>
    <message>
        <source>Max. change since last calibration</source>
        <translation>距上次标定的最大变化</translation>
    </message>
    <message>
        <source>Calibration interval (days)</source>
        <translation>标定周期（天）</translation>
    </message>
    <message>
        <source>Nominal tip centre</source>
        <translation>测头标称中心</translation>
    </message>
    <message>
        <source>Comment</source>
        <translation>备注</translation>
    </message>
    <message>
        <source>Last day of use, for example {0}; empty for none</source>
        <translation>最后可用日，例如 {0}；留空表示不限</translation>
    </message>
    <message>
        <source>No limit</source>
        <translation>无限值</translation>
    </message>
    <message>
        <source>Max. distance of the tip from its previous calibration. Beyond it, the result needs checking.</source>
        <translation>测头与上次标定位置的最大距离。超出时，结果需检查。</translation>
    </message>
    <message>
        <source>Ball diameter</source>
        <translation>测球直径</translation>
    </message>
</context>
<context>
    <name>JobProgress</name>
    <message>
        <source>Progress</source>
        <translation>进度</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>取消</translation>
    </message>
</context>
<context>
    <name>LaboratoryDialog</name>
    <message>
        <source>Calibration laboratory</source>
        <translation>校准实验室</translation>
    </message>
    <message>
        <source>Name</source>
        <translation>名称</translation>
    </message>
    <message>
        <source>E-mail address</source>
        <translation>电子邮箱</translation>
    </message>
    <message>
        <source>City</source>
        <translation>城市</translation>
    </message>
    <message>
        <source>Country code, two capital letters such as DE</source>
        <translation>国家代码，两个大写字母，例如 DE</translation>
    </message>
    <message>
        <source>Street (optional)</source>
        <translation>街道（可选）</translation>
    </message>
    <message>
        <source>Post code (optional)</source>
        <translation>邮政编码（可选）</translation>
    </message>
    <message>
        <source>Procedure (optional)</source>
        <translation>规程（可选）</translation>
    </message>
    <message>
        <source>Place of calibration</source>
        <translation>标定地点</translation>
    </message>
    <message>
        <source>Laboratory</source>
        <translation>实验室</translation>
    </message>
    <message>
        <source>Customer</source>
        <translation>客户</translation>
    </message>
    <message>
        <source>Branch of the laboratory</source>
        <translation>实验室分支机构</translation>
    </message>
    <message>
        <source>Branch of the customer</source>
        <translation>客户分支机构</translation>
    </message>
    <message>
        <source>Elsewhere</source>
        <translation>其他地点</translation>
    </message>
    <message>
        <source>Save...</source>
        <translation>保存...</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>取消</translation>
    </message>
</context>
<context>
    <name>LastResultPanel</name>
    <message>
        <source>Last practice with this pen and tip</source>
        <translation>本光笔和测头的上次练习</translation>
    </message>
    <message>
        <source>Last calibration of this pen and tip</source>
        <translation>本光笔和测头的上次标定</translation>
    </message>
    <message>
        <source>Tip centre / mm</source>
        <translation>测头中心 / mm</translation>
    </message>
    <message>
        <source>U (k = 2) / mm</source>
        <translation>U (k = 2) / mm</translation>
    </message>
    <message>
        <source>Half a minute: leave the tip in the cone and lean the pen to six sides.</source>
        <translation>半分钟：测头留在锥孔里，将光笔向六个方向倾斜。</translation>
    </message>
    <message>
        <source>Verify tip</source>
        <translation>验证测头</translation>
    </message>
    <message>
        <source>Revoke acceptance...</source>
        <translation>撤销接受...</translation>
    </message>
    <message>
        <source>Reinstate the previous result. Both results stay in the archive.</source>
        <translation>恢复使用前一结果。两个结果都保留在档案库中。</translation>
    </message>
    <message>
        <source>Last calibration not available</source>
        <translation>无法显示上次标定</translation>
    </message>
    <message>
        <source>No result yet</source>
        <translation>尚无结果</translation>
    </message>
    <message>
        <source>Accepted practice results are stored apart from real pens.</source>
        <translation>练习结果与真实光笔的结果分开保存。</translation>
    </message>
    <message>
        <source>The first accepted result becomes the current tip.</source>
        <translation>首次接受的结果即为当前测头数据。</translation>
    </message>
    <message>
        <source>Select a pen and a tip to see the last calibration.</source>
        <translation>选择光笔和测头后显示上次标定。</translation>
    </message>
    <message>
        <source>Accepted. Reason: {0}</source>
        <translation>已接受。理由：{0}</translation>
    </message>
    <message>
        <source>Accepted by supervisor {0}. Reason: {1}</source>
        <translation>由主管 {0} 接受。理由：{1}</translation>
    </message>
    <message>
        <source>Calibration date is in the future. Check the clock of this computer.</source>
        <translation>标定日期晚于现在。请检查本机时钟。</translation>
    </message>
    <message>
        <source>Calibration is older than {0} days. Calibrate before you measure.</source>
        <translation>标定已超过 {0} 天。测量前请重新标定。</translation>
    </message>
    <message>
        <source>In the future</source>
        <translation>日期在将来</translation>
    </message>
</context>
<context>
    <name>LedFilePanel</name>
    <message>
        <source>Unit of the file</source>
        <translation>文件的单位</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>取消</translation>
    </message>
    <message>
        <source>LEDs of the pen</source>
        <translation>光笔的 LED</translation>
    </message>
    <message>
        <source>LEDs of a pen ({0})</source>
        <translation>光笔 LED 文件 ({0})</translation>
    </message>
    <message>
        <source>{0} does not state the unit of its coordinates. Choose it:</source>
        <translation>{0} 未注明坐标单位。请选择：</translation>
    </message>
    <message>
        <source>Save the corrected LEDs</source>
        <translation>保存改正后的 LED</translation>
    </message>
    <message>
        <source>{0} corrected</source>
        <translation>{0} 已改正</translation>
    </message>
    <message>
        <source>LEDs saved as {0} and in use.</source>
        <translation>LED 已保存为 {0} 并使用。</translation>
    </message>
    <message>
        <source>{0} Use it for this pen from now on?</source>
        <translation>{0} 今后将其用于此光笔吗？</translation>
    </message>
    <message>
        <source>Use this file</source>
        <translation>使用此文件</translation>
    </message>
    <message>
        <source>{0} remains open.</source>
        <translation>{0} 仍处于打开状态。</translation>
    </message>
    <message>
        <source>LED &amp;file</source>
        <translation>LED 文件(&amp;F)</translation>
    </message>
    <message>
        <source>LED file</source>
        <translation>LED 文件</translation>
    </message>
    <message>
        <source>Table (CSV) or JSON file</source>
        <translation>表格 (CSV) 或 JSON 文件</translation>
    </message>
    <message>
        <source>Open...</source>
        <translation>打开...</translation>
    </message>
    <message>
        <source>Use file of the simulated pen</source>
        <translation>使用模拟光笔的文件</translation>
    </message>
    <message>
        <source>I have no such file...</source>
        <translation>我没有此文件...</translation>
    </message>
    <message>
        <source>Find pen, camera and tip by one swing and one length.</source>
        <translation>由一次摆动和一个长度求光笔、相机和测头。</translation>
    </message>
</context>
<context>
    <name>LedTable</name>
    <message>
        <source>LED coordinates</source>
        <translation>LED 坐标</translation>
    </message>
    <message>
        <source>LED</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>RMS / px</source>
        <translation>残差 / px</translation>
    </message>
    <message>
        <source>Distance between the detected LED and its table position in the live image / px</source>
        <translation>实时图像中检测到的 LED 与表中位置之差 / px</translation>
    </message>
</context>
<context>
    <name>LedTablePanel</name>
    <message>
        <source>LED coordinates</source>
        <translation>LED 坐标</translation>
    </message>
    <message>
        <source>Disc Ø {0:g} mm</source>
        <translation>圆盘 Ø {0:g} mm</translation>
    </message>
    <message>
        <source>Nominal tip: {0} mm</source>
        <translation>标称测头：{0} mm</translation>
    </message>
    <message>
        <source>Nominal tip in use (step Start): {0} mm</source>
        <translation>使用中的标称测头（“开始”步骤）：{0} mm</translation>
    </message>
</context>
<context>
    <name>LedsPage</name>
    <message>
        <source>LEDs</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>Open the LED file of this pen. It is compared with the recorded images.</source>
        <translation>请打开本光笔的 LED 文件，程序将其与录制的图像比较。</translation>
    </message>
    <message>
        <source>Open the LED file of this pen and hold the pen in view of the camera.</source>
        <translation>请打开本光笔的 LED 文件，并将光笔置于相机视野内。</translation>
    </message>
    <message>
        <source>Swap {0} and {1}</source>
        <translation>交换 {0} 和 {1}</translation>
    </message>
    <message>
        <source>Transform to pen frame</source>
        <translation>转换到光笔坐标系</translation>
    </message>
    <message>
        <source>Other layout than the ten-LED pen; the frame of the file is used as is.</source>
        <translation>不是十 LED 光笔的布局；直接采用文件的坐标系。</translation>
    </message>
    <message>
        <source>The LEDs are in the pen frame.</source>
        <translation>LED 在光笔坐标系中。</translation>
    </message>
    <message>
        <source>The swing will probably fail.</source>
        <translation>摆动很可能失败。</translation>
    </message>
    <message>
        <source>Swing anyway</source>
        <translation>仍然摆动</translation>
    </message>
    <message>
        <source>Continue to the swing</source>
        <translation>下一步：摆动</translation>
    </message>
</context>
<context>
    <name>LibraryControl</name>
    <message>
        <source>choose another tip.</source>
        <translation>请另选一个。</translation>
    </message>
    <message>
        <source>Tip {0} is not in the tip library. Add it?</source>
        <translation>测头库中没有测头 {0}。是否添加？</translation>
    </message>
    <message>
        <source>Not now</source>
        <translation>暂不</translation>
    </message>
    <message>
        <source>Add tip</source>
        <translation>添加测头</translation>
    </message>
    <message>
        <source>Tip {0} is retired: {1}</source>
        <translation>测头 {0} 已停用：{1}</translation>
    </message>
</context>
<context>
    <name>LibraryDialog</name>
    <message>
        <source>Retire {0}</source>
        <translation>停用 {0}</translation>
    </message>
    <message>
        <source>Retire...</source>
        <translation>停用...</translation>
    </message>
    <message>
        <source>Tip library</source>
        <translation>测头库</translation>
    </message>
    <message>
        <source>Pens, tips, cones, cameras and references with their limits. Each change is recorded in the archive with name and time.</source>
        <translation>光笔、测头、锥座、相机和标准器及其限值。每次更改均连同姓名和时间记入存档。</translation>
    </message>
    <message>
        <source>Tips</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>Pens</source>
        <translation>光笔</translation>
    </message>
    <message>
        <source>Cones</source>
        <translation>锥孔</translation>
    </message>
    <message>
        <source>Cameras</source>
        <translation>相机</translation>
    </message>
    <message>
        <source>References</source>
        <translation>标准器</translation>
    </message>
    <message>
        <source>State</source>
        <translation>状态</translation>
    </message>
    <message>
        <source>New item</source>
        <translation>新项</translation>
    </message>
    <message>
        <source>Reactivate {0}</source>
        <translation>恢复使用 {0}</translation>
    </message>
    <message>
        <source>Select an item in the table.</source>
        <translation>请在表中选择一项。</translation>
    </message>
    <message>
        <source>This item is retired.</source>
        <translation>该项已停用。</translation>
    </message>
    <message>
        <source>Use this item for calibration</source>
        <translation>用该项进行标定</translation>
    </message>
    <message>
        <source>Edit this item</source>
        <translation>编辑该项</translation>
    </message>
    <message>
        <source>Retired items stay in the archive</source>
        <translation>停用的项仍保留在档案库中</translation>
    </message>
    <message>
        <source>Reactivate...</source>
        <translation>恢复使用...</translation>
    </message>
    <message>
        <source>Enter an ID.</source>
        <translation>请输入编号。</translation>
    </message>
    <message>
        <source>Enter a date such as 2026-08-14, or leave it empty.</source>
        <translation>请输入日期，例如 2026-08-14，或留空。</translation>
    </message>
    <message>
        <source>Changes need a supervisor&apos;s signature.</source>
        <translation>更改须由主管签署。</translation>
    </message>
    <message>
        <source>Saving</source>
        <translation>正在保存</translation>
    </message>
    <message>
        <source>Saved with your name and the time</source>
        <translation>连同您的姓名和时间保存</translation>
    </message>
    <message>
        <source>ID</source>
        <translation>编号</translation>
    </message>
    <message>
        <source>Expiry date</source>
        <translation>有效期至</translation>
    </message>
    <message>
        <source>Ball / mm</source>
        <translation>测球 / mm</translation>
    </message>
    <message>
        <source>Change / mm</source>
        <translation>变化 / mm</translation>
    </message>
    <message>
        <source>Calibrated on pens</source>
        <translation>已在以下光笔上标定</translation>
    </message>
    <message>
        <source>Show retired items</source>
        <translation>显示已停用项</translation>
    </message>
    <message>
        <source>Save</source>
        <translation>保存</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>取消</translation>
    </message>
    <message>
        <source>Reason for change</source>
        <translation>更改理由</translation>
    </message>
    <message>
        <source>Choose</source>
        <translation>选用</translation>
    </message>
    <message>
        <source>Comment</source>
        <translation>备注</translation>
    </message>
    <message>
        <source>Add...</source>
        <translation>添加...</translation>
    </message>
    <message>
        <source>Change...</source>
        <translation>更改...</translation>
    </message>
    <message>
        <source>Close</source>
        <translation>关闭</translation>
    </message>
</context>
<context>
    <name>LimitsDialog</name>
    <message>
        <source>Close</source>
        <translation>关闭</translation>
    </message>
    <message>
        <source>Acceptance limits of the station</source>
        <translation>工位的接受限值</translation>
    </message>
    <message>
        <source>The minimum number of images exceeds the maximum number.</source>
        <translation>最少图像数大于最多图像数。</translation>
    </message>
    <message>
        <source>Results outside these limits need a supervisor&apos;s approval and a reason. Each change is recorded with name and time.</source>
        <translation>超出限值的结果须由主管批准并说明理由。每次更改都连同姓名和时间记录。</translation>
    </message>
    <message>
        <source>Sign with the supervisor password.</source>
        <translation>用主管密码签署。</translation>
    </message>
    <message>
        <source>No password is set. The one you enter becomes the supervisor password.</source>
        <translation>尚未设置密码。您输入的密码将成为主管密码。</translation>
    </message>
    <message>
        <source>Save limits</source>
        <translation>保存限值</translation>
    </message>
    <message>
        <source>New password; empty to keep the current one</source>
        <translation>新密码；留空则不变</translation>
    </message>
    <message>
        <source>No limit</source>
        <translation>无限值</translation>
    </message>
    <message>
        <source>Default: {0}.</source>
        <translation>默认值：{0}。</translation>
    </message>
</context>
<context>
    <name>LimitsForm</name>
    <message>
        <source>Acceptance limits</source>
        <translation>接受限值</translation>
    </message>
    <message>
        <source>All limits...</source>
        <translation>所有限值...</translation>
    </message>
    <message>
        <source>Acceptance limits of swings and verifications; set by a supervisor.</source>
        <translation>摆动和验证的接受限值；由主管设定。</translation>
    </message>
    <message>
        <source>Max. expanded uncertainty U (k = 2)</source>
        <translation>扩展不确定度 U (k = 2) 上限</translation>
    </message>
    <message>
        <source>Min. images</source>
        <translation>最少图像数</translation>
    </message>
    <message>
        <source>Max. images</source>
        <translation>最多图像数</translation>
    </message>
    <message>
        <source>The swing ends when U of the tip along its weakest direction is within this limit. Default: {0} mm.</source>
        <translation>测头最弱方向上的 U 不超过此限值时，摆动结束。默认值：{0} mm。</translation>
    </message>
    <message>
        <source>The swing does not end with fewer images. Not above the maximum. Default: {0}.</source>
        <translation>图像少于此数时摆动不会结束；不得大于最多图像数。默认值：{0}。</translation>
    </message>
    <message>
        <source>The swing ends at this number of images. Not below the minimum. Default: {0}.</source>
        <translation>图像达到此数时摆动结束；不得小于最少图像数。默认值：{0}。</translation>
    </message>
</context>
<context>
    <name>LiveDetectionView</name>
    <message>
        <source>Image size does not match this swing.</source>
        <translation>图像尺寸与本次摆动不符。</translation>
    </message>
    <message>
        <source>Bright spots: {0}, {1} fps</source>
        <translation>亮点：{0}，{1} 幅/秒</translation>
    </message>
    <message>
        <source>{0} of {1} LEDs, {2} fps</source>
        <translation>{0} / {1} 个 LED，{2} 幅/秒</translation>
    </message>
</context>
<context>
    <name>LivePanel</name>
    <message>
        <source>Wheel or + and - to zoom, arrow keys to move, 0 for the whole image.</source>
        <translation>滚轮或 + 和 - 缩放，方向键移动，0 显示全图。</translation>
    </message>
    <message>
        <source>Connecting</source>
        <translation>正在连接</translation>
    </message>
    <message>
        <source>Live</source>
        <translation>实时</translation>
    </message>
    <message>
        <source>No images</source>
        <translation>无图像</translation>
    </message>
    <message>
        <source>Opening the camera</source>
        <translation>正在打开相机</translation>
    </message>
    <message>
        <source>Waiting for the first image</source>
        <translation>正在等待第一幅图像</translation>
    </message>
    <message>
        <source>The camera responds but sends no images. Check trigger and cable.</source>
        <translation>相机有响应但没有发送图像。请检查触发和线缆。</translation>
    </message>
    <message>
        <source>{0} Reconnecting automatically.</source>
        <translation>{0}正在自动重连。</translation>
    </message>
    <message>
        <source>{0} fps</source>
        <translation>{0} 幅/秒</translation>
    </message>
    <message>
        <source>Lost: {0}</source>
        <translation>丢失：{0}</translation>
    </message>
    <message>
        <source>Bright spots: {0}</source>
        <translation>亮点：{0}</translation>
    </message>
    <message>
        <source>Lost, reconnecting</source>
        <translation>连接中断，正在重连</translation>
    </message>
    <message>
        <source>Not connected</source>
        <translation>未连接</translation>
    </message>
    <message>
        <source>{0} x {1} px</source>
        <translation>{0} × {1} px</translation>
    </message>
    <message>
        <source>{0} of {1} LEDs</source>
        <translation>{0} / {1} 个 LED</translation>
    </message>
    <message>
        <source>, other spots: {0}</source>
        <translation>，其他光点：{0}</translation>
    </message>
</context>
<context>
    <name>LiveView</name>
    <message>
        <source>Camera {0}: {1}</source>
        <translation>相机 {0}：{1}</translation>
    </message>
</context>
<context>
    <name>MainWindow</name>
    <message>
        <source>Answer the question first.</source>
        <translation>请先回答问题。</translation>
    </message>
    <message>
        <source>Press this button at the computer.</source>
        <translation>请在计算机上按此按钮。</translation>
    </message>
    <message>
        <source>Pen tip calibration</source>
        <translation>光笔测头标定</translation>
    </message>
</context>
<context>
    <name>MatchPanel</name>
    <message>
        <source>Live match</source>
        <translation>实时匹配</translation>
    </message>
    <message>
        <source>No match yet</source>
        <translation>尚无匹配</translation>
    </message>
    <message>
        <source>Wheel or + and - to zoom, arrow keys to move, 0 for the whole image.</source>
        <translation>滚轮或 + 和 - 缩放，方向键移动，0 显示全图。</translation>
    </message>
    <message>
        <source>No camera is open. See the step Camera.</source>
        <translation>没有打开相机。请看“相机”步骤。</translation>
    </message>
    <message>
        <source>Camera connection lost. Reconnecting automatically.</source>
        <translation>相机连接中断，正在自动重连。</translation>
    </message>
    <message>
        <source>Intrinsics file missing. See the step Camera.</source>
        <translation>缺少内参文件。请看“相机”步骤。</translation>
    </message>
    <message>
        <source>Open the LED file first.</source>
        <translation>请先打开 LED 文件。</translation>
    </message>
    <message>
        <source>No image yet</source>
        <translation>还没有图像</translation>
    </message>
    <message>
        <source>Swing in progress</source>
        <translation>摆动进行中</translation>
    </message>
    <message>
        <source>Rings: expected from the LED file</source>
        <translation>圆环：由 LED 文件预期的位置</translation>
    </message>
    <message>
        <source>Pen not found</source>
        <translation>未找到光笔</translation>
    </message>
    <message>
        <source>{0} of {1} LEDs</source>
        <translation>{0} / {1} 个 LED</translation>
    </message>
    <message>
        <source>RMS residual {0} px</source>
        <translation>残差均方根 {0} px</translation>
    </message>
    <message>
        <source>Tilt and turn the pen so that it is seen from all sides.</source>
        <translation>倾斜并转动光笔，让相机从各个方向看到它。</translation>
    </message>
    <message>
        <source>The LEDs agree with the images but not with the pen frame. See the message about the file.</source>
        <translation>LED 与图像相符，但与光笔坐标系不符。请看文件处的说明。</translation>
    </message>
    <message>
        <source>All LEDs fit their table positions, in {0} views.</source>
        <translation>全部 LED 与表中位置一致，共 {0} 个视角。</translation>
    </message>
</context>
<context>
    <name>MeasurePage</name>
    <message>
        <source>Measure</source>
        <translation>测量</translation>
    </message>
</context>
<context>
    <name>MeasurePresenter</name>
    <message>
        <source>now</source>
        <translation>进行中</translation>
    </message>
    <message>
        <source>Deviation {0} mm</source>
        <translation>偏差 {0} mm</translation>
    </message>
    <message>
        <source>Point {0} of {1}</source>
        <translation>第 {0} 点，共 {1} 点</translation>
    </message>
    <message>
        <source>Open a plan...</source>
        <translation>打开计划…</translation>
    </message>
    <message>
        <source>Measure the next part</source>
        <translation>测量下一个工件</translation>
    </message>
    <message>
        <source>NO PLAN YET</source>
        <translation>尚无计划</translation>
    </message>
    <message>
        <source>Feature {0} of {1}</source>
        <translation>要素 {0} / {1}</translation>
    </message>
    <message>
        <source>Measure features of a part with the current tip.</source>
        <translation>用当前测头测量工件的要素。</translation>
    </message>
    <message>
        <source>Choose a plan</source>
        <translation>请选择测量计划</translation>
    </message>
    <message>
        <source>Nothing to measure</source>
        <translation>没有可测量的内容</translation>
    </message>
    <message>
        <source>Part measured</source>
        <translation>工件已测量</translation>
    </message>
    <message>
        <source>Not proven</source>
        <translation>未证明</translation>
    </message>
    <message>
        <source>Out of tolerance</source>
        <translation>超差</translation>
    </message>
    <message>
        <source>NOT OK</source>
        <translation>不合格</translation>
    </message>
</context>
<context>
    <name>MethodsPanel</name>
    <message>
        <source>Two-stage method and joint fit</source>
        <translation>两步法与联合拟合</translation>
    </message>
    <message>
        <source>Report this method</source>
        <translation>报告该方法</translation>
    </message>
    <message>
        <source>U (k = 2)</source>
        <translation>U (k = 2)</translation>
    </message>
    <message>
        <source>Difference</source>
        <translation>差值</translation>
    </message>
    <message>
        <source>of it by projected discs</source>
        <translation>其中由圆面投影引起</translation>
    </message>
    <message>
        <source>RMS / mm</source>
        <translation>均方根 / mm</translation>
    </message>
    <message>
        <source>Joint fit</source>
        <translation>联合拟合</translation>
    </message>
    <message>
        <source>Also for later swings here</source>
        <translation>也用于此工位以后的摆动</translation>
    </message>
    <message>
        <source>Two-stage (paper)</source>
        <translation>两步法（论文）</translation>
    </message>
</context>
<context>
    <name>MonteCarloRow</name>
    <message>
        <source>Monte Carlo check</source>
        <translation>蒙特卡洛检验</translation>
    </message>
    <message>
        <source>Propagates the distributions of files, seating and noise by the Monte Carlo method (JCGM 101). Uses all processor cores but one for seconds to minutes.</source>
        <translation>用蒙特卡洛法传播文件、就位和噪声的分布（JCGM 101）。将占用除一个以外的所有处理器核心，历时数秒至数分钟。</translation>
    </message>
    <message>
        <source>Trials</source>
        <translation>试验次数</translation>
    </message>
    <message>
        <source>U by Monte Carlo and by uncertainty budget</source>
        <translation>蒙特卡洛法与不确定度报告的 U</translation>
    </message>
    <message>
        <source>Available for swings with one camera only.</source>
        <translation>仅适用于单相机的摆动。</translation>
    </message>
    <message>
        <source>{0} trials successful, {1} failed.</source>
        <translation>{0} 次试验成功，{1} 次失败。</translation>
    </message>
    <message>
        <source>U (k = 2) by Monte Carlo / mm</source>
        <translation>蒙特卡洛法的 U (k = 2) / mm</translation>
    </message>
    <message>
        <source>its standard error / mm</source>
        <translation>其标准误差 / mm</translation>
    </message>
    <message>
        <source>U (k = 2) by uncertainty budget / mm</source>
        <translation>不确定度报告的 U (k = 2) / mm</translation>
    </message>
    <message>
        <source>Difference / standard error</source>
        <translation>差值 / 标准误差</translation>
    </message>
</context>
<context>
    <name>NamesForm</name>
    <message>
        <source>List of pens</source>
        <translation>光笔列表</translation>
    </message>
    <message>
        <source>List of tips</source>
        <translation>测头列表</translation>
    </message>
    <message>
        <source>List of cones</source>
        <translation>锥孔列表</translation>
    </message>
    <message>
        <source>Choose from the tip library, or open it (arrow down)</source>
        <translation>从测头库选择，或打开测头库（向下键）</translation>
    </message>
    <message>
        <source>Station and operator</source>
        <translation>工位与操作员</translation>
    </message>
    <message>
        <source>Item under calibration</source>
        <translation>标定对象</translation>
    </message>
    <message>
        <source>Pen serial number</source>
        <translation>光笔序列号</translation>
    </message>
    <message>
        <source>Nominal tip centre</source>
        <translation>测头标称中心</translation>
    </message>
    <message>
        <source>Choose a station to restore its settings, or enter a new name.</source>
        <translation>选择工位可恢复其设置，也可输入新名称。</translation>
    </message>
    <message>
        <source>Not specified</source>
        <translation>未指定</translation>
    </message>
    <message>
        <source>Station</source>
        <translation>工位</translation>
    </message>
    <message>
        <source>Operator</source>
        <translation>操作员</translation>
    </message>
    <message>
        <source>Cone</source>
        <translation>锥孔</translation>
    </message>
    <message>
        <source>Probe tip</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>Ball diameter</source>
        <translation>测球直径</translation>
    </message>
</context>
<context>
    <name>NoticeBar</name>
    <message>
        <source>Close</source>
        <translation>关闭</translation>
    </message>
</context>
<context>
    <name>NumberField</name>
    <message>
        <source>Enter a number, {0}.</source>
        <translation>请输入数值，{0}。</translation>
    </message>
    <message>
        <source>{0} is not a unit here; enter {1}.</source>
        <translation>此处不能使用单位 {0}；请输入 {1}。</translation>
    </message>
    <message>
        <source>Enter a whole number.</source>
        <translation>请输入整数。</translation>
    </message>
    <message>
        <source>At most {0} decimals are possible.</source>
        <translation>最多 {0} 位小数。</translation>
    </message>
    <message>
        <source>Allowed: {0}.</source>
        <translation>允许范围：{0}。</translation>
    </message>
    <message>
        <source>For {0} enter {1}.</source>
        <translation>如指 {0}，请输入 {1}。</translation>
    </message>
</context>
<context>
    <name>OperatorView</name>
    <message>
        <source>Operator view</source>
        <translation>操作员视图</translation>
    </message>
    <message>
        <source>Esc: leave this view</source>
        <translation>Esc：退出此视图</translation>
    </message>
</context>
<context>
    <name>OptionsMenu</name>
    <message>
        <source>System default</source>
        <translation>跟随系统</translation>
    </message>
    <message>
        <source>Light</source>
        <translation>浅色</translation>
    </message>
    <message>
        <source>Dark</source>
        <translation>深色</translation>
    </message>
    <message>
        <source>{0} m</source>
        <translation>{0} 米</translation>
    </message>
    <message>
        <source>Language</source>
        <translation>语言</translation>
    </message>
    <message>
        <source>Appearance</source>
        <translation>外观</translation>
    </message>
    <message>
        <source>Viewing distance</source>
        <translation>观看距离</translation>
    </message>
    <message>
        <source>Mute sounds</source>
        <translation>关闭声音</translation>
    </message>
    <message>
        <source>Data folder...</source>
        <translation>数据文件夹...</translation>
    </message>
    <message>
        <source>About Lightpen</source>
        <translation>关于 Lightpen</translation>
    </message>
    <message>
        <source>Data folder</source>
        <translation>数据文件夹</translation>
    </message>
    <message>
        <source>From the next start, swings and results are saved in {0}. Existing ones remain in place.</source>
        <translation>从下次启动起，摆动记录和结果保存在 {0}。现有的仍留在原处。</translation>
    </message>
    <message>
        <source>Sounds are off.</source>
        <translation>声音已关闭。</translation>
    </message>
    <message>
        <source>Sounds are on.</source>
        <translation>声音已打开。</translation>
    </message>
    <message>
        <source>Keep open</source>
        <translation>不关闭</translation>
    </message>
    <message>
        <source>Close anyway</source>
        <translation>仍然关闭</translation>
    </message>
</context>
<context>
    <name>PartDialog</name>
    <message>
        <source>Binned or cropped images</source>
        <translation>合并或裁剪的图像</translation>
    </message>
    <message>
        <source>An intrinsics file for these images is written beside the file of the whole sensor. The region is in pixels of that file, before binning.</source>
        <translation>将在整个传感器的文件旁写入适用于这些图像的内参文件。区域以该文件的像素计，为像素合并之前。</translation>
    </message>
    <message>
        <source>Binning</source>
        <translation>像素合并</translation>
    </message>
    <message>
        <source>Left edge</source>
        <translation>左边缘</translation>
    </message>
    <message>
        <source>Top edge</source>
        <translation>上边缘</translation>
    </message>
    <message>
        <source>Width</source>
        <translation>宽度</translation>
    </message>
    <message>
        <source>Height</source>
        <translation>高度</translation>
    </message>
    <message>
        <source>Write and use</source>
        <translation>写入并使用</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>取消</translation>
    </message>
</context>
<context>
    <name>PartView</name>
    <message>
        <source>No points yet</source>
        <translation>尚无测点</translation>
    </message>
    <message>
        <source>The part in space: {0} points, {1} lines of features</source>
        <translation>工件三维图：{0} 个点，{1} 条要素线</translation>
    </message>
    <message>
        <source>Deviations are drawn {0} times as large.</source>
        <translation>偏差放大 {0} 倍显示。</translation>
    </message>
</context>
<context>
    <name>PenFiles</name>
    <message>
        <source>{0} is the LED file of pen {1}, not of pen {2}.</source>
        <translation>{0} 是光笔 {1} 的 LED 文件，而不是光笔 {2} 的。</translation>
    </message>
    <message>
        <source>{0} is not the LED file stored with pen {1} ({2}).</source>
        <translation>{0} 不是与光笔 {1} 一起保存的 LED 文件（{2}）。</translation>
    </message>
    <message>
        <source>{0} was changed since it was stored with pen {1}.</source>
        <translation>{0} 自随光笔 {1} 保存以来已被更改。</translation>
    </message>
    <message>
        <source>{0} of {1}</source>
        <translation>{0}（{1}）</translation>
    </message>
    <message>
        <source>LED file</source>
        <translation>LED 文件</translation>
    </message>
    <message>
        <source>{0} was changed since it was stored with pen {1}. Open the LED file of this pen.</source>
        <translation>{0} 在与光笔 {1} 一起保存后被更改。请打开此光笔的 LED 文件。</translation>
    </message>
</context>
<context>
    <name>PenPanel</name>
    <message>
        <source>LEDs since the first swing / µm</source>
        <translation>自首次摆动以来各 LED 的位移 / µm</translation>
    </message>
    <message>
        <source>Reading the swings of the pen.</source>
        <translation>正在读取该光笔的摆动。</translation>
    </message>
    <message>
        <source>Two accepted swings of pen {0} with this LED file are needed; so far: {1}.</source>
        <translation>需要光笔 {0} 用此 LED 文件的两次已接受摆动；现有 {1} 次。</translation>
    </message>
    <message>
        <source>Swings with another LED file, or unreadable: {0}.</source>
        <translation>使用其他 LED 文件或无法读取的摆动：{0}。</translation>
    </message>
</context>
<context>
    <name>PenView</name>
    <message>
        <source>LED layout</source>
        <translation>LED 布局</translation>
    </message>
    <message>
        <source>tip</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>The LEDs in space</source>
        <translation>LED 空间视图</translation>
    </message>
    <message>
        <source>{0} LEDs</source>
        <translation>{0} 个 LED</translation>
    </message>
    <message>
        <source>Drag or press the arrow keys to rotate, 0 to reset.</source>
        <translation>拖动或按方向键旋转，按 0 复位。</translation>
    </message>
</context>
<context>
    <name>PlanPanel</name>
    <message>
        <source>Measure by a plan in a YAML file.</source>
        <translation>按 YAML 文件中的测量计划测量。</translation>
    </message>
    <message>
        <source>Only with the simulated camera.</source>
        <translation>仅适用于模拟相机。</translation>
    </message>
    <message>
        <source>Open a plan...</source>
        <translation>打开计划…</translation>
    </message>
    <message>
        <source>Teach a plan</source>
        <translation>示教计划</translation>
    </message>
    <message>
        <source>Try the simulated plate</source>
        <translation>试测模拟平板</translation>
    </message>
    <message>
        <source>Features are recognised while they are probed; save them as a plan at the end.</source>
        <translation>测量时自动识别要素；结束时可保存为计划。</translation>
    </message>
    <message>
        <source>Ten features of a plate that the simulated operator probes.</source>
        <translation>由模拟操作者测量的平板，含十个要素。</translation>
    </message>
    <message>
        <source>Other plan</source>
        <translation>其他计划</translation>
    </message>
    <message>
        <source>Kind of the feature that is probed</source>
        <translation>正在触测的要素类型</translation>
    </message>
    <message>
        <source>Recognise</source>
        <translation>识别</translation>
    </message>
    <message>
        <source>Save plan...</source>
        <translation>保存测量计划...</translation>
    </message>
    <message>
        <source>Save a plan with the measured features as nominals.</source>
        <translation>以测得的要素为标称值保存测量计划。</translation>
    </message>
    <message>
        <source>Export...</source>
        <translation>导出...</translation>
    </message>
    <message>
        <source>Open a measuring plan</source>
        <translation>打开测量计划</translation>
    </message>
    <message>
        <source>Measuring plans ({0})</source>
        <translation>测量计划 ({0})</translation>
    </message>
    <message>
        <source>Part</source>
        <translation>工件</translation>
    </message>
    <message>
        <source>Leave the plan? The points of this part are discarded.</source>
        <translation>离开此计划？该工件的测点将被丢弃。</translation>
    </message>
    <message>
        <source>Leave the plan</source>
        <translation>离开计划</translation>
    </message>
    <message>
        <source>Continue</source>
        <translation>继续</translation>
    </message>
    <message>
        <source>Save the measuring plan</source>
        <translation>保存测量计划</translation>
    </message>
    <message>
        <source>Export the measured part</source>
        <translation>导出测得的工件</translation>
    </message>
    <message>
        <source>Saved: {0}</source>
        <translation>已保存：{0}</translation>
    </message>
</context>
<context>
    <name>PointField</name>
    <message>
        <source>As in the LED file</source>
        <translation>同 LED 文件</translation>
    </message>
    <message>
        <source>As in the LED file: {0} mm</source>
        <translation>同 LED 文件：{0} mm</translation>
    </message>
    <message>
        <source>Nominal tip centre, {0}</source>
        <translation>测头标称中心，{0}</translation>
    </message>
</context>
<context>
    <name>PostureDial</name>
    <message>
        <source>Postures</source>
        <translation>姿态</translation>
    </message>
    <message>
        <source>Images needed in each posture, seen from above</source>
        <translation>各姿态还需要的图像数（俯视）</translation>
    </message>
    <message>
        <source>{0} of {1} postures complete</source>
        <translation>{1} 个姿态中已完成 {0} 个</translation>
    </message>
    <message>
        <source>turn about the pen&apos;s own axis</source>
        <translation>绕光笔自身轴线转动</translation>
    </message>
</context>
<context>
    <name>PressTests</name>
    <message>
        <source>Press test</source>
        <translation>压力试验</translation>
    </message>
</context>
<context>
    <name>PrintReportWindow</name>
    <message>
        <source>Pages</source>
        <translation>页面</translation>
    </message>
    <message>
        <source>Save as PDF...</source>
        <translation>另存为 PDF...</translation>
    </message>
    <message>
        <source>Print...</source>
        <translation>打印...</translation>
    </message>
    <message>
        <source>Close</source>
        <translation>关闭</translation>
    </message>
    <message>
        <source>Save report</source>
        <translation>保存报告</translation>
    </message>
    <message>
        <source>Saved as {0}</source>
        <translation>已保存为 {0}</translation>
    </message>
</context>
<context>
    <name>ProbingPage</name>
    <message>
        <source>The work is not finished. The points of the current task are lost; results are kept.</source>
        <translation>工作尚未完成。当前任务的点将丢失；结果会保留。</translation>
    </message>
    <message>
        <source>No image yet</source>
        <translation>尚无图像</translation>
    </message>
    <message>
        <source>Figure</source>
        <translation>图示</translation>
    </message>
    <message>
        <source>Details</source>
        <translation>详情</translation>
    </message>
    <message>
        <source>List</source>
        <translation>列表</translation>
    </message>
    <message>
        <source>Checks and features</source>
        <translation>检查项与要素</translation>
    </message>
    <message>
        <source>Live image</source>
        <translation>实时图像</translation>
    </message>
</context>
<context>
    <name>ProbingSimulatorControls</name>
    <message>
        <source>Simulated pen</source>
        <translation>模拟光笔</translation>
    </message>
    <message>
        <source>Probes all tasks automatically.</source>
        <translation>自动触测所有任务。</translation>
    </message>
    <message>
        <source>Let the simulated operator probe</source>
        <translation>让模拟操作员触测</translation>
    </message>
</context>
<context>
    <name>ProgressPanel</name>
    <message>
        <source>Report...</source>
        <translation>报告…</translation>
    </message>
    <message>
        <source>Undo point</source>
        <translation>撤销点</translation>
    </message>
    <message>
        <source>Discard the last point of the current task.</source>
        <translation>丢弃当前任务的最后一个点。</translation>
    </message>
    <message>
        <source>Start over</source>
        <translation>重新开始</translation>
    </message>
    <message>
        <source>Discard all points, and start with the current tip.</source>
        <translation>丢弃所有点，并用当前测头重新开始。</translation>
    </message>
    <message>
        <source>Start over? Results are kept.</source>
        <translation>重新开始？结果会保留。</translation>
    </message>
    <message>
        <source>Saved: {0}</source>
        <translation>已保存：{0}</translation>
    </message>
    <message>
        <source>Progress</source>
        <translation>进度</translation>
    </message>
    <message>
        <source>Continue</source>
        <translation>继续</translation>
    </message>
</context>
<context>
    <name>QFileDialog</name>
    <message>
        <source>&amp;Look in:</source>
        <translation>查看(&amp;L)：</translation>
    </message>
    <message>
        <source>Files of &amp;type:</source>
        <translation>文件类型(&amp;T)：</translation>
    </message>
</context>
<context>
    <name>ReasonBar</name>
    <message>
        <source>The tip was replaced or refitted.</source>
        <translation>测头已更换或重新安装。</translation>
    </message>
    <message>
        <source>The pen was repaired or its LEDs were measured again.</source>
        <translation>光笔已维修，或其 LED 已重新测量。</translation>
    </message>
    <message>
        <source>The station is being set up.</source>
        <translation>工位正在设置。</translation>
    </message>
    <message>
        <source>The cause was found and has no effect on this tip.</source>
        <translation>原因已查明，对此测头没有影响。</translation>
    </message>
    <message>
        <source>The accuracy is sufficient for this measurement.</source>
        <translation>其准确度足以满足本次测量。</translation>
    </message>
    <message>
        <source>Reasons</source>
        <translation>理由</translation>
    </message>
    <message>
        <source>Letters needed: {0}; entered: {1}.</source>
        <translation>需要字符数：{0}；已输入：{1}。</translation>
    </message>
</context>
<context>
    <name>ResidualView</name>
    <message>
        <source>Recorded image</source>
        <translation>记录的图像</translation>
    </message>
</context>
<context>
    <name>ResidualsPanel</name>
    <message>
        <source>Residuals × {0}</source>
        <translation>残差 × {0}</translation>
    </message>
    <message>
        <source>x / px</source>
        <translation>x / px</translation>
    </message>
    <message>
        <source>y / px</source>
        <translation>y / px</translation>
    </message>
    <message>
        <source>Lens field × {0}</source>
        <translation>镜头残余场 × {0}</translation>
    </message>
    <message>
        <source>Residuals by LED / px</source>
        <translation>各 LED 的残差 / px</translation>
    </message>
    <message>
        <source>RMS</source>
        <translation>均方根</translation>
    </message>
    <message>
        <source>The arrows should look random. A pattern indicates an error of the intrinsics file; a single outlying LED, of the LED file.</source>
        <translation>箭头应随机分布。若有规律，说明内参文件有误；若单个 LED 异常，说明 LED 文件有误。</translation>
    </message>
    <message>
        <source>LED</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>mean x</source>
        <translation>x 均值</translation>
    </message>
    <message>
        <source>mean y</source>
        <translation>y 均值</translation>
    </message>
</context>
<context>
    <name>ResultPanel</name>
    <message>
        <source>The tip beside others</source>
        <translation>测头与其他值的比较</translation>
    </message>
    <message>
        <source>{0} of {1} images included</source>
        <translation>计入 {0} / {1} 幅图像</translation>
    </message>
    <message>
        <source>Previous, {0} / mm</source>
        <translation>上次，{0} / mm</translation>
    </message>
    <message>
        <source>Change / mm</source>
        <translation>变化 / mm</translation>
    </message>
    <message>
        <source>Nominal / mm</source>
        <translation>标称值 / mm</translation>
    </message>
    <message>
        <source>Deviation / mm</source>
        <translation>偏差 / mm</translation>
    </message>
    <message>
        <source>No earlier result</source>
        <translation>无更早结果</translation>
    </message>
    <message>
        <source>As found: {0} mm from the previous calibration</source>
        <translation>标定前状态：与上次标定相差 {0} mm</translation>
    </message>
    <message>
        <source>Odd and even images agree: {0}</source>
        <translation>奇数与偶数图像一致：{0}</translation>
    </message>
    <message>
        <source>Odd and even images differ significantly: {0}</source>
        <translation>奇数与偶数图像有显著差异：{0}</translation>
    </message>
    <message>
        <source>Self-check of the LEDs: {0}, limit {1}</source>
        <translation>LED 自检：{0}，限值 {1}</translation>
    </message>
    <message>
        <source>As found: {0} mm from the previous calibration, limit {1} mm</source>
        <translation>标定前状态：与上次标定相差 {0} mm，限值 {1} mm</translation>
    </message>
</context>
<context>
    <name>ResultTools</name>
    <message>
        <source>Open the folder of the swing</source>
        <translation>打开本次摆动的文件夹</translation>
    </message>
    <message>
        <source>Open folder</source>
        <translation>打开文件夹</translation>
    </message>
    <message>
        <source>Copy x, y, z in mm, separated by tabs</source>
        <translation>复制 x、y、z（mm，以制表符分隔）</translation>
    </message>
    <message>
        <source>Preview, save as PDF, or print</source>
        <translation>预览、另存为 PDF 或打印</translation>
    </message>
    <message>
        <source>Swing again with firm pressure and compare: shows a stylus that gives way</source>
        <translation>用力按压再摆动一次并比较：可显示测杆的退让</translation>
    </message>
    <message>
        <source>Press test</source>
        <translation>压力试验</translation>
    </message>
    <message>
        <source>Calibration report...</source>
        <translation>标定报告...</translation>
    </message>
    <message>
        <source>Other formats</source>
        <translation>其他格式</translation>
    </message>
    <message>
        <source>Save results, named by pen, tip and date</source>
        <translation>保存结果，按笔、测头和日期命名</translation>
    </message>
    <message>
        <source>Record and tables</source>
        <translation>记录和表格</translation>
    </message>
    <message>
        <source>Tip copied: x, y, z in mm.</source>
        <translation>已复制测头坐标：x、y、z，单位 mm。</translation>
    </message>
    <message>
        <source>Folder for saving</source>
        <translation>保存到的文件夹</translation>
    </message>
    <message>
        <source>Saved in {0}</source>
        <translation>已保存到 {0}</translation>
    </message>
    <message>
        <source>Copy tip</source>
        <translation>复制测头坐标</translation>
    </message>
    <message>
        <source>Save...</source>
        <translation>保存...</translation>
    </message>
</context>
<context>
    <name>ReviewPage</name>
    <message>
        <source>Review</source>
        <translation>复核</translation>
    </message>
    <message>
        <source>Swing the pen first.</source>
        <translation>请先摆动光笔。</translation>
    </message>
    <message>
        <source>Accept</source>
        <translation>接受</translation>
    </message>
    <message>
        <source>Swing in progress</source>
        <translation>摆动进行中</translation>
    </message>
    <message>
        <source>All recorded images are loaded.</source>
        <translation>录制的图像已全部载入。</translation>
    </message>
    <message>
        <source>Accept the tip first. The report is made from the accepted result.</source>
        <translation>请先接受测头。报告由已接受的结果生成。</translation>
    </message>
    <message>
        <source>Tip accepted.</source>
        <translation>测头已接受。</translation>
    </message>
    <message>
        <source>Use longer part</source>
        <translation>用较长部分</translation>
    </message>
    <message>
        <source>Report joint fit</source>
        <translation>报告联合拟合</translation>
    </message>
    <message>
        <source>Check settings</source>
        <translation>检查设置</translation>
    </message>
    <message>
        <source>Check files</source>
        <translation>检查文件</translation>
    </message>
    <message>
        <source>Repeat swing</source>
        <translation>重新摆动</translation>
    </message>
    <message>
        <source>Repeat the swing from the start? These images remain on the disk.</source>
        <translation>从头重新摆动吗？这些图像仍保留在磁盘上。</translation>
    </message>
    <message>
        <source>Continue with these</source>
        <translation>沿用这些图像</translation>
    </message>
    <message>
        <source>The tip appears here after the swing.</source>
        <translation>摆动后在此显示测头。</translation>
    </message>
    <message>
        <source>Next: start the next calibration or close the program.</source>
        <translation>下一步：开始下一次标定，或关闭程序。</translation>
    </message>
    <message>
        <source>The result takes effect when it is accepted.</source>
        <translation>结果在接受后生效。</translation>
    </message>
    <message>
        <source>Next: record more images and load all of them again.</source>
        <translation>下一步：补录图像，然后重新载入全部图像。</translation>
    </message>
    <message>
        <source>Next: include the images again, or repeat the swing.</source>
        <translation>下一步：恢复这些图像，或重新摆动。</translation>
    </message>
    <message>
        <source>{0} Until then the previous result remains current.</source>
        <translation>{0}在此之前仍使用原结果。</translation>
    </message>
    <message>
        <source>Computing the tip</source>
        <translation>正在计算测头</translation>
    </message>
    <message>
        <source>Saving the result</source>
        <translation>正在保存结果</translation>
    </message>
    <message>
        <source>Result not acceptable. Capture more images or repeat the swing.</source>
        <translation>结果不可接受。请继续采集图像，或重新摆动。</translation>
    </message>
    <message>
        <source>Tip accepted. Start the next calibration.</source>
        <translation>测头已接受。请开始下一次标定。</translation>
    </message>
    <message>
        <source>These images gave no tip.</source>
        <translation>这些图像未得出测头中心。</translation>
    </message>
    <message>
        <source>Acceptance revoked. The swing is saved; open it with the file swing.lightpen in {0}.</source>
        <translation>已撤销接受。摆动已保存；用 {0} 中的 swing.lightpen 文件可重新打开。</translation>
    </message>
    <message>
        <source>Tip not accepted. The swing is saved; you can resume it at the next start.</source>
        <translation>测头尚未接受。摆动已保存，下次启动时可以继续。</translation>
    </message>
    <message>
        <source>Saved {0}. Earlier results stay in the archive.</source>
        <translation>保存于 {0}。以前的结果保留在档案中。</translation>
    </message>
    <message>
        <source>Saved {0}, check needed. Reason for acceptance: {1}</source>
        <translation>保存于 {0}，需检查。接受原因：{1}</translation>
    </message>
    <message>
        <source>This swing belongs to tip {0}, pen {1}; the step Start now shows tip {2}, pen {3}.</source>
        <translation>本次摆动属于测头 {0}、光笔 {1}；“开始”步骤现为测头 {2}、光笔 {3}。</translation>
    </message>
    <message>
        <source>Capture more</source>
        <translation>继续采集</translation>
    </message>
    <message>
        <source>Back to Start</source>
        <translation>返回“开始”</translation>
    </message>
    <message>
        <source>Swing tip {0}</source>
        <translation>摆动测头 {0}</translation>
    </message>
    <message>
        <source>Read the result first.</source>
        <translation>请先查看结果。</translation>
    </message>
    <message>
        <source>NO TIP YET</source>
        <translation>尚无结果</translation>
    </message>
    <message>
        <source>{0}: {1}</source>
        <translation>{0}：{1}</translation>
    </message>
</context>
<context>
    <name>ReviewView</name>
    <message>
        <source>Adds images to this swing</source>
        <translation>为本次摆动增加图像</translation>
    </message>
    <message>
        <source>Starts a new swing without these images</source>
        <translation>不用这些图像，重新摆动</translation>
    </message>
    <message>
        <source>Accept with a reason</source>
        <translation>注明理由后接受</translation>
    </message>
    <message>
        <source>Images</source>
        <translation>图像</translation>
    </message>
    <message>
        <source>Residuals</source>
        <translation>残差</translation>
    </message>
    <message>
        <source>Uncertainty</source>
        <translation>不确定度</translation>
    </message>
    <message>
        <source>Two-stage</source>
        <translation>两步法</translation>
    </message>
    <message>
        <source>Result</source>
        <translation>结果</translation>
    </message>
    <message>
        <source>Details</source>
        <translation>详细信息</translation>
    </message>
    <message>
        <source>Repeat swing</source>
        <translation>重新摆动</translation>
    </message>
    <message>
        <source>Half a minute: leave the tip in the cone and lean the pen to six sides.</source>
        <translation>半分钟：测头留在锥孔里，将光笔向六个方向倾斜。</translation>
    </message>
    <message>
        <source>This result needs checking. Enter the reason for accepting it.</source>
        <translation>该结果需检查。请填写接受理由。</translation>
    </message>
    <message>
        <source>Accept with reason</source>
        <translation>按此理由接受</translation>
    </message>
    <message>
        <source>Capture more</source>
        <translation>继续采集</translation>
    </message>
    <message>
        <source>Accept...</source>
        <translation>接受...</translation>
    </message>
    <message>
        <source>Verify tip</source>
        <translation>验证测头</translation>
    </message>
    <message>
        <source>Revoke acceptance...</source>
        <translation>撤销接受...</translation>
    </message>
    <message>
        <source>Reinstate the previous result. Both results stay in the archive.</source>
        <translation>恢复使用前一结果。两个结果都保留在档案库中。</translation>
    </message>
    <message>
        <source>Reason</source>
        <translation>理由</translation>
    </message>
    <message>
        <source>Do not accept</source>
        <translation>不接受</translation>
    </message>
</context>
<context>
    <name>RigPanel</name>
    <message>
        <source>Rig file of both cameras</source>
        <translation>两台相机的相机组文件</translation>
    </message>
    <message>
        <source>Rig files ({0})</source>
        <translation>相机组文件 ({0})</translation>
    </message>
    <message>
        <source>Two cameras</source>
        <translation>双相机</translation>
    </message>
    <message>
        <source>Use a second camera</source>
        <translation>使用第二台相机</translation>
    </message>
    <message>
        <source>Open the file with the extrinsics of both cameras. Create it from board images with &quot;lightpen extrinsics LEFT RIGHT --board BOARD --out rig.json&quot;.</source>
        <translation>请打开含两台相机外参的文件。可由标定板图像生成：&quot;lightpen extrinsics LEFT RIGHT --board BOARD --out rig.json&quot;。</translation>
    </message>
    <message>
        <source>Baseline {2} ({0}-{1})</source>
        <translation>基线 {2}（{0}-{1}）</translation>
    </message>
    <message>
        <source>{0} remains in use: {1}</source>
        <translation>{0} 仍在使用：{1}</translation>
    </message>
    <message>
        <source>The cameras are synchronised.</source>
        <translation>两台相机同步。</translation>
    </message>
    <message>
        <source>{0} Unpaired images: {1}.</source>
        <translation>{0}未配对的图像：{1} 幅。</translation>
    </message>
    <message>
        <source>Rig file</source>
        <translation>相机组文件</translation>
    </message>
    <message>
        <source>Open...</source>
        <translation>打开...</translation>
    </message>
</context>
<context>
    <name>SelectionPanel</name>
    <message>
        <source>Select two entries with a tip to compare them.</source>
        <translation>选择两个带测头数据的条目即可比较。</translation>
    </message>
    <message>
        <source>{0} and {1}</source>
        <translation>{0} 与 {1}</translation>
    </message>
    <message>
        <source>Earlier / mm</source>
        <translation>较早 / mm</translation>
    </message>
    <message>
        <source>Later / mm</source>
        <translation>较晚 / mm</translation>
    </message>
    <message>
        <source>Change / mm</source>
        <translation>变化 / mm</translation>
    </message>
    <message>
        <source>U (k = 2) / mm</source>
        <translation>U (k = 2) / mm</translation>
    </message>
    <message>
        <source>The entries belong to different pens or tips.</source>
        <translation>二者不是同一光笔和测头。</translation>
    </message>
    <message>
        <source>The change is within the combined uncertainty.</source>
        <translation>变化在合成不确定度范围内。</translation>
    </message>
    <message>
        <source>Repeatability of the {0} selected calibrations</source>
        <translation>所选 {0} 次标定的重复性</translation>
    </message>
    <message>
        <source>Repeatability of all {0} calibrations of the trend</source>
        <translation>趋势中全部 {0} 次标定的重复性</translation>
    </message>
    <message>
        <source>Repeatability needs two calibrations of one tip.</source>
        <translation>重复性至少需要同一测头的两次标定。</translation>
    </message>
    <message>
        <source>Repeatability report...</source>
        <translation>重复性报告…</translation>
    </message>
    <message>
        <source>Repeatability</source>
        <translation>重复性</translation>
    </message>
    <message>
        <source>Mean / mm</source>
        <translation>平均 / mm</translation>
    </message>
    <message>
        <source>Std. dev. / mm</source>
        <translation>标准差 / mm</translation>
    </message>
    <message>
        <source>Range / mm</source>
        <translation>极差 / mm</translation>
    </message>
    <message>
        <source>Stated U / mm</source>
        <translation>给出的 U / mm</translation>
    </message>
</context>
<context>
    <name>SettingsPanel</name>
    <message>
        <source>Free running</source>
        <translation>自由运行</translation>
    </message>
    <message>
        <source>The whole sensor is already in use.</source>
        <translation>已使用整个传感器。</translation>
    </message>
    <message>
        <source>Colour images are converted to grey, which reduces accuracy. Use a grey format such as Mono8, or better a monochrome camera.</source>
        <translation>彩色图像会转换为灰度，准确度因此下降。请使用 Mono8 等灰度格式，最好用黑白相机。</translation>
    </message>
    <message>
        <source>Received: {0}</source>
        <translation>已接收：{0}</translation>
    </message>
    <message>
        <source>Incomplete: {0}</source>
        <translation>不完整：{0}</translation>
    </message>
    <message>
        <source>Lost: {0}</source>
        <translation>丢失：{0}</translation>
    </message>
    <message>
        <source>Not processed: {0}</source>
        <translation>未处理：{0}</translation>
    </message>
    <message>
        <source>Software trigger</source>
        <translation>软件触发</translation>
    </message>
    <message>
        <source>Camera settings</source>
        <translation>相机设置</translation>
    </message>
    <message>
        <source>Frame rate</source>
        <translation>帧率</translation>
    </message>
    <message>
        <source>Pixel format</source>
        <translation>像素格式</translation>
    </message>
    <message>
        <source>Trigger</source>
        <translation>触发</translation>
    </message>
    <message>
        <source>Packet size</source>
        <translation>数据包大小</translation>
    </message>
    <message>
        <source>Region width</source>
        <translation>区域宽度</translation>
    </message>
    <message>
        <source>Region from left</source>
        <translation>区域左边距</translation>
    </message>
    <message>
        <source>Region</source>
        <translation>区域</translation>
    </message>
    <message>
        <source>from left, top</source>
        <translation>左、上边距</translation>
    </message>
    <message>
        <source>Region height</source>
        <translation>区域高度</translation>
    </message>
    <message>
        <source>Region from top</source>
        <translation>区域上边距</translation>
    </message>
    <message>
        <source>Whole sensor</source>
        <translation>整个传感器</translation>
    </message>
    <message>
        <source>Images of this camera: received; incomplete and discarded; lost; not processed because the computer was too slow.</source>
        <translation>此相机的图像：已接收；不完整而舍弃；丢失；因计算机太慢而未处理。</translation>
    </message>
    <message>
        <source>fps</source>
        <translation>幅/秒</translation>
    </message>
    <message>
        <source>Larger packets reduce the computer load. Network card and switches must support them (jumbo frames).</source>
        <translation>较大的数据包可减轻计算机负担。网卡和交换机须支持（巨型帧）。</translation>
    </message>
</context>
<context>
    <name>SetupView</name>
    <message>
        <source>Enter what you are calibrating. Entries are saved for this station.</source>
        <translation>填写标定对象。所填内容按工位保存。</translation>
    </message>
    <message>
        <source>More</source>
        <translation>更多</translation>
    </message>
    <message>
        <source>Default uncertainties...</source>
        <translation>默认不确定度...</translation>
    </message>
    <message>
        <source>Focal length, scale, temperature, form of ball and cone: uncertainty where no file states it.</source>
        <translation>焦距、尺度、温度、测球与锥孔形状：文件未给出时的不确定度。</translation>
    </message>
    <message>
        <source>Show the tips of this station</source>
        <translation>显示本工位的测头</translation>
    </message>
    <message>
        <source>Other ways to begin</source>
        <translation>其他开始方式</translation>
    </message>
    <message>
        <source>Tip {0} is retired. Choose another tip, or reactivate it in the tip library.</source>
        <translation>测头 {0} 已停用。请另选一个，或在测头库中恢复使用。</translation>
    </message>
</context>
<context>
    <name>Sidebar</name>
    <message>
        <source>Pen {0}</source>
        <translation>光笔 {0}</translation>
    </message>
    <message>
        <source>Tip {0}</source>
        <translation>测头 {0}</translation>
    </message>
    <message>
        <source>Cone {0}</source>
        <translation>锥孔 {0}</translation>
    </message>
    <message>
        <source>Pen tip calibration</source>
        <translation>光笔测头标定</translation>
    </message>
    <message>
        <source>Operator view</source>
        <translation>操作员视图</translation>
    </message>
    <message>
        <source>Help</source>
        <translation>帮助</translation>
    </message>
    <message>
        <source>Options</source>
        <translation>选项</translation>
    </message>
</context>
<context>
    <name>SourcePanel</name>
    <message>
        <source>Cameras found: {0}</source>
        <translation>找到的相机：{0}</translation>
    </message>
    <message>
        <source>GenTL producer of the camera</source>
        <translation>相机的 GenTL 生产者文件</translation>
    </message>
    <message>
        <source>GenTL producers ({0})</source>
        <translation>GenTL 生产者文件 ({0})</translation>
    </message>
    <message>
        <source>Folder of the recorded images</source>
        <translation>录制图像的文件夹</translation>
    </message>
    <message>
        <source>Video of the pen</source>
        <translation>光笔视频</translation>
    </message>
    <message>
        <source>Videos and images ({0})</source>
        <translation>视频和图像 ({0})</translation>
    </message>
    <message>
        <source> and </source>
        <translation> 和 </translation>
    </message>
    <message>
        <source>Search in progress</source>
        <translation>正在搜索</translation>
    </message>
    <message>
        <source>Searching for cameras</source>
        <translation>正在搜索相机</translation>
    </message>
    <message>
        <source>No camera found. Check power and cable, or enter its serial number or address.</source>
        <translation>没有找到相机。请检查电源和线缆，或输入其序列号或地址。</translation>
    </message>
    <message>
        <source>Found with the images: {0}</source>
        <translation>与图像一同找到：{0}</translation>
    </message>
    <message>
        <source>Use both files</source>
        <translation>使用两个文件</translation>
    </message>
    <message>
        <source>Use file</source>
        <translation>使用文件</translation>
    </message>
    <message>
        <source>Image source</source>
        <translation>图像来源</translation>
    </message>
    <message>
        <source>Image source of the second camera</source>
        <translation>第二台相机的图像来源</translation>
    </message>
    <message>
        <source>{0} - not installed</source>
        <translation>{0} - 未安装</translation>
    </message>
    <message>
        <source>Choose your camera</source>
        <translation>请选择您的相机</translation>
    </message>
    <message>
        <source>Folder, record or video</source>
        <translation>文件夹、记录或视频</translation>
    </message>
    <message>
        <source>Open...</source>
        <translation>打开...</translation>
    </message>
    <message>
        <source>Folder or record...</source>
        <translation>文件夹或记录...</translation>
    </message>
    <message>
        <source>Video...</source>
        <translation>视频...</translation>
    </message>
    <message>
        <source>GenTL producer</source>
        <translation>GenTL 生产者文件</translation>
    </message>
    <message>
        <source>GenTL producers of the system</source>
        <translation>系统的 GenTL 生产者文件</translation>
    </message>
    <message>
        <source>Serial number or address</source>
        <translation>序列号或地址</translation>
    </message>
    <message>
        <source>Search</source>
        <translation>搜索</translation>
    </message>
    <message>
        <source>Use its files</source>
        <translation>使用其文件</translation>
    </message>
    <message>
        <source>Use the intrinsics file and the LED file of the simulated pen.</source>
        <translation>使用模拟光笔的内参文件和 LED 文件。</translation>
    </message>
    <message>
        <source>Try again</source>
        <translation>重试</translation>
    </message>
</context>
<context>
    <name>StartPage</name>
    <message>
        <source>Start</source>
        <translation>开始</translation>
    </message>
    <message>
        <source>Where is the tip of the pen?</source>
        <translation>光笔的测头在哪里？</translation>
    </message>
    <message>
        <source>Set up station</source>
        <translation>设置工位</translation>
    </message>
    <message>
        <source>Choose a tip, seat it in the cone and start the swing.</source>
        <translation>选择测头，将其放入锥孔，然后开始摆动。</translation>
    </message>
    <message>
        <source>Choose how to begin.</source>
        <translation>请选择如何开始。</translation>
    </message>
    <message>
        <source>Continue to the camera</source>
        <translation>下一步：相机</translation>
    </message>
</context>
<context>
    <name>StepButton</name>
    <message>
        <source>done</source>
        <translation>已完成</translation>
    </message>
    <message>
        <source>done, check needed</source>
        <translation>已完成，需检查</translation>
    </message>
    <message>
        <source>now</source>
        <translation>进行中</translation>
    </message>
    <message>
        <source>to do</source>
        <translation>待完成</translation>
    </message>
    <message>
        <source>closed</source>
        <translation>未开放</translation>
    </message>
</context>
<context>
    <name>StepList</name>
    <message>
        <source>Steps</source>
        <translation>步骤</translation>
    </message>
</context>
<context>
    <name>StrayLightPanel</name>
    <message>
        <source>Stray light</source>
        <translation>杂散光</translation>
    </message>
    <message>
        <source>Search</source>
        <translation>搜索</translation>
    </message>
    <message>
        <source>Cover the pen, then search for stray light.</source>
        <translation>遮住光笔，再搜索杂散光。</translation>
    </message>
    <message>
        <source>Clear mask</source>
        <translation>清除屏蔽</translation>
    </message>
    <message>
        <source>stray</source>
        <translation>杂散光</translation>
    </message>
    <message>
        <source>No images are received.</source>
        <translation>没有收到图像。</translation>
    </message>
    <message>
        <source>Search in progress</source>
        <translation>正在搜索</translation>
    </message>
    <message>
        <source>No spots to mask</source>
        <translation>没有需要屏蔽的光点</translation>
    </message>
    <message>
        <source>No mask is set.</source>
        <translation>没有屏蔽区。</translation>
    </message>
    <message>
        <source>Masked areas: {0}</source>
        <translation>屏蔽区：{0} 处</translation>
    </message>
    <message>
        <source>The pen is still visible; nothing was masked. Cover all LEDs, then search again.</source>
        <translation>仍能看到光笔，未屏蔽任何光点。请遮住全部 LED，再次搜索。</translation>
    </message>
    <message>
        <source>The bright spots move and are not stray light. Cover the pen, then search again.</source>
        <translation>亮点在移动，不是杂散光。请遮住光笔，再次搜索。</translation>
    </message>
    <message>
        <source>No stray light found.</source>
        <translation>未发现杂散光。</translation>
    </message>
    <message>
        <source>Stray spots: {0}. Mask them or remove their source.</source>
        <translation>杂散光点：{0} 个。请屏蔽或移走光源。</translation>
    </message>
    <message>
        <source>Bright spots: {0}. Is the pen covered? Without its LED file, LEDs cannot be distinguished from stray light.</source>
        <translation>亮点：{0} 个。光笔遮住了吗？没有 LED 文件就无法区分 LED 与杂散光。</translation>
    </message>
    <message>
        <source>Mask the spots: {0}</source>
        <translation>屏蔽光点：{0}</translation>
    </message>
    <message>
        <source>Mask the spots</source>
        <translation>屏蔽光点</translation>
    </message>
    <message>
        <source>Searching: image {0} of {1}</source>
        <translation>正在搜索：图像 {0} / {1}</translation>
    </message>
</context>
<context>
    <name>StreamDialog</name>
    <message>
        <source>Live stream</source>
        <translation>实时数据流</translation>
    </message>
    <message>
        <source>Address</source>
        <translation>地址</translation>
    </message>
    <message>
        <source>Every computer in this network can receive the data without signing in. A firewall may ask for permission.</source>
        <translation>该网络中的每台计算机无需登录即可接收数据。防火墙可能会要求许可。</translation>
    </message>
    <message>
        <source>Sends pose and tip live by OpenIGTLink to other programs such as 3D Slicer.</source>
        <translation>通过 OpenIGTLink 向其他程序（例如 3D Slicer）实时发送位姿和测头位置。</translation>
    </message>
    <message>
        <source>{0} for this computer only, {1} for all networks, or an address of this computer.</source>
        <translation>{0} 仅限本机，{1} 对所有网络开放，或填写本机的某个地址。</translation>
    </message>
    <message>
        <source>Port</source>
        <translation>端口</translation>
    </message>
    <message>
        <source>Stream pose and tip</source>
        <translation>发送位姿和测头位置</translation>
    </message>
    <message>
        <source>Close</source>
        <translation>关闭</translation>
    </message>
</context>
<context>
    <name>StreamService</name>
    <message>
        <source>Live stream...</source>
        <translation>实时数据流...</translation>
    </message>
    <message>
        <source>Live stream at {0}, clients: {1}</source>
        <translation>实时数据流 {0}，客户端：{1}</translation>
    </message>
    <message>
        <source>({0} of them miss images)</source>
        <translation>（其中 {0} 个丢失图像）</translation>
    </message>
    <message>
        <source>Active at {0}. Clients: {1}</source>
        <translation>已开启：{0}。客户端：{1}</translation>
    </message>
    <message>
        <source>Only the pose is sent; there is no current tip.</source>
        <translation>只发送位姿；没有当前测头。</translation>
    </message>
</context>
<context>
    <name>SupervisorFields</name>
    <message>
        <source>Supervisor</source>
        <translation>主管</translation>
    </message>
    <message>
        <source>Supervisor password</source>
        <translation>主管密码</translation>
    </message>
</context>
<context>
    <name>SwingPage</name>
    <message>
        <source>Swing</source>
        <translation>摆动</translation>
    </message>
    <message>
        <source>Finish early</source>
        <translation>提前结束</translation>
    </message>
    <message>
        <source>Review</source>
        <translation>复核</translation>
    </message>
    <message>
        <source>All recorded images are loaded.</source>
        <translation>录制的图像已全部载入。</translation>
    </message>
    <message>
        <source>Swing not finished. The captured images ({0}) are saved; you can resume the swing at the next start.</source>
        <translation>摆动尚未完成。已采集的图像（{0} 幅）已保存，下次启动时可以继续。</translation>
    </message>
    <message>
        <source>Finish now</source>
        <translation>现在结束</translation>
    </message>
    <message>
        <source>Open the camera</source>
        <translation>打开相机</translation>
    </message>
    <message>
        <source>Try again</source>
        <translation>重试</translation>
    </message>
    <message>
        <source>No image captured yet</source>
        <translation>尚未采集图像</translation>
    </message>
    <message>
        <source>Computing the tip</source>
        <translation>正在计算测头</translation>
    </message>
    <message>
        <source>Swing in progress</source>
        <translation>摆动进行中</translation>
    </message>
    <message>
        <source>Tip not computed yet</source>
        <translation>测头尚未计算</translation>
    </message>
    <message>
        <source>Continue (Space)</source>
        <translation>继续（空格）</translation>
    </message>
    <message>
        <source>Pause (Space)</source>
        <translation>暂停（空格）</translation>
    </message>
    <message>
        <source>Stop computing</source>
        <translation>停止计算</translation>
    </message>
    <message>
        <source>Compute again</source>
        <translation>重新计算</translation>
    </message>
    <message>
        <source>Capture more</source>
        <translation>继续采集</translation>
    </message>
    <message>
        <source>Continue swinging</source>
        <translation>继续摆动</translation>
    </message>
    <message>
        <source>Settings were changed during this swing. The swing continues with its original files, names and limits.</source>
        <translation>摆动期间更改了设置。本次摆动继续使用开始时的文件、名称和限值。</translation>
    </message>
    <message>
        <source>Restart with new settings</source>
        <translation>用新设置重新开始</translation>
    </message>
    <message>
        <source>Continue this swing</source>
        <translation>继续本次摆动</translation>
    </message>
    <message>
        <source>Start over? The images of this swing ({0}) are set aside and remain on the disk.</source>
        <translation>重新开始吗？本次摆动的图像（{0} 幅）将被搁置，仍保留在磁盘上。</translation>
    </message>
    <message>
        <source>Restart swing</source>
        <translation>重新摆动</translation>
    </message>
</context>
<context>
    <name>SwingPlots</name>
    <message>
        <source>image</source>
        <translation>图像</translation>
    </message>
    <message>
        <source>Residuals and U</source>
        <translation>残差与 U</translation>
    </message>
    <message>
        <source>Tip</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>Residual of each image</source>
        <translation>每幅图像的残差</translation>
    </message>
    <message>
        <source>How far the LEDs of an image are from where the fit expects them. This fit takes the LEDs as in their file; that of the review may correct them, and leave smaller residuals.</source>
        <translation>图像中的 LED 与拟合预期位置的距离。此拟合采用文件中的 LED 位置；复核中的拟合可修正这些位置，残差因而更小。</translation>
    </message>
    <message>
        <source>Uncertainty of the tip</source>
        <translation>测头的不确定度</translation>
    </message>
    <message>
        <source>U of the tip in its weakest direction. The swing ends below the limit (horizontal line). Dashed: what more images cannot improve.</source>
        <translation>测头在最弱方向上的 U。降到限值（水平线）以下时摆动结束。虚线：更多图像也无法改善的部分。</translation>
    </message>
    <message>
        <source>Tip of each image</source>
        <translation>每幅图像的测头</translation>
    </message>
    <message>
        <source>The tip by each image alone, from the cone: u to the right, v down, w away from the camera. A step means that the tip has slipped.</source>
        <translation>仅由每幅图像得到的测头，相对于锥孔：u 向右，v 向下，w 远离相机。出现台阶表示测头滑动过。</translation>
    </message>
    <message>
        <source>Estimate of the tip</source>
        <translation>测头的估计</translation>
    </message>
    <message>
        <source>The tip by all images so far, from its newest value. First estimates that are far off are cut off.</source>
        <translation>由至今全部图像得到的测头，相对于其最新值。最初偏离很远的估计不全部显示。</translation>
    </message>
    <message>
        <source>limit {0} µm</source>
        <translation>限值 {0} µm</translation>
    </message>
    <message>
        <source>achievable</source>
        <translation>可达到</translation>
    </message>
    <message>
        <source>U (k = 2) / µm</source>
        <translation>U (k = 2) / µm</translation>
    </message>
</context>
<context>
    <name>SwingSimulatorControls</name>
    <message>
        <source>Simulated pen</source>
        <translation>模拟光笔</translation>
    </message>
    <message>
        <source>Other movements</source>
        <translation>其他动作</translation>
    </message>
    <message>
        <source>What else the simulated operator can do with the pen</source>
        <translation>模拟操作员还能用光笔做的动作</translation>
    </message>
    <message>
        <source>Seats the tip in the cone</source>
        <translation>将测头放入锥孔</translation>
    </message>
    <message>
        <source>Simulated swing</source>
        <translation>模拟摆动</translation>
    </message>
    <message>
        <source>Let the simulated operator swing</source>
        <translation>让模拟操作员摆动</translation>
    </message>
    <message>
        <source>Seats the tip and follows the arrow automatically</source>
        <translation>自动将测头就位并跟随箭头</translation>
    </message>
    <message>
        <source>Lets the tip slip by {0} mm for a moment</source>
        <translation>让测头短暂滑动 {0} mm</translation>
    </message>
    <message>
        <source>Swings the pen about the cone regardless of the arrow</source>
        <translation>绕锥孔摆动光笔，不跟随箭头</translation>
    </message>
    <message>
        <source>Holds the pen still</source>
        <translation>保持光笔不动</translation>
    </message>
    <message>
        <source>Lifts the tip out of the cone</source>
        <translation>将测头从锥孔中抬起</translation>
    </message>
    <message>
        <source>Moves the pen out of the image</source>
        <translation>将光笔移出图像</translation>
    </message>
    <message>
        <source>Covers the LEDs for a moment</source>
        <translation>短暂遮住 LED</translation>
    </message>
    <message>
        <source>Seat</source>
        <translation>就位</translation>
    </message>
    <message>
        <source>Swing</source>
        <translation>摆动</translation>
    </message>
    <message>
        <source>Hold</source>
        <translation>保持</translation>
    </message>
    <message>
        <source>Lift</source>
        <translation>抬起</translation>
    </message>
    <message>
        <source>Leave</source>
        <translation>离开</translation>
    </message>
    <message>
        <source>Slip</source>
        <translation>滑动</translation>
    </message>
    <message>
        <source>Cover</source>
        <translation>遮挡</translation>
    </message>
</context>
<context>
    <name>SwingView</name>
    <message>
        <source>No image yet</source>
        <translation>还没有图像</translation>
    </message>
    <message>
        <source>Progress</source>
        <translation>进度</translation>
    </message>
    <message>
        <source>Left and right are swapped</source>
        <translation>左右互换</translation>
    </message>
    <message>
        <source>Learn again on which side you stand.</source>
        <translation>重新识别您所站的一侧。</translation>
    </message>
    <message>
        <source>Start over</source>
        <translation>重新开始</translation>
    </message>
    <message>
        <source>Abandon this swing and start again. Its images remain on the disk.</source>
        <translation>放弃本次摆动并重新开始。图像保留在磁盘上。</translation>
    </message>
</context>
<context>
    <name>SwingWords</name>
    <message>
        <source>No swing</source>
        <translation>没有摆动</translation>
    </message>
    <message>
        <source>recorded images</source>
        <translation>录制的图像</translation>
    </message>
    <message>
        <source>{0} rejected</source>
        <translation>已舍去 {0} 幅</translation>
    </message>
    <message>
        <source>Not computed</source>
        <translation>尚未计算</translation>
    </message>
    <message>
        <source>Accepted</source>
        <translation>已接受</translation>
    </message>
    <message>
        <source>Done</source>
        <translation>完成</translation>
    </message>
    <message>
        <source>Capture more</source>
        <translation>继续采集</translation>
    </message>
    <message>
        <source>Hold the pen upright and still for 3 s to see the review.</source>
        <translation>把光笔竖直握住不动 3 秒，即可查看结果。</translation>
    </message>
    <message>
        <source>No images</source>
        <translation>无图像</translation>
    </message>
    <message>
        <source>The swing starts when the step Swing is opened at the computer.</source>
        <translation>在计算机上打开“摆动”步骤后，摆动即开始。</translation>
    </message>
    <message>
        <source>The camera sends no images. No data is lost. Press Space to continue when images are received.</source>
        <translation>相机没有发送图像。没有数据丢失。收到图像后按空格键继续。</translation>
    </message>
    <message>
        <source>The images are saved. Compute the tip again or start over.</source>
        <translation>图像已保存。请重新计算测头，或重新开始。</translation>
    </message>
    <message>
        <source>You can put the pen down.</source>
        <translation>可以放下光笔。</translation>
    </message>
    <message>
        <source>Return to the step Swing at the computer to continue.</source>
        <translation>请在计算机上回到“摆动”步骤以继续。</translation>
    </message>
    <message>
        <source>An image could not be recorded (see the message at the top). Correct the cause, then press Space.</source>
        <translation>有图像无法记录（见顶部提示）。排除原因后按空格键。</translation>
    </message>
    <message>
        <source>Computing the tip</source>
        <translation>正在计算测头</translation>
    </message>
    <message>
        <source>Let the simulated operator swing.</source>
        <translation>请让模拟操作员摆动。</translation>
    </message>
    <message>
        <source>Press test: press the tip firmly into the cone.</source>
        <translation>压力试验：将测头用力压入锥座。</translation>
    </message>
    <message>
        <source>Check needed</source>
        <translation>需检查</translation>
    </message>
    <message>
        <source>Repeat swing</source>
        <translation>重新摆动</translation>
    </message>
    <message>
        <source>Continue at the computer.</source>
        <translation>请在计算机上继续。</translation>
    </message>
    <message>
        <source>Put the pen down. Continue at the computer.</source>
        <translation>请放下光笔，在计算机上继续。</translation>
    </message>
    <message>
        <source>Continue with the review.</source>
        <translation>请继续复核。</translation>
    </message>
    <message>
        <source>The camera sends no images. No data is lost. The swing continues automatically when images are received.</source>
        <translation>相机没有发送图像。没有数据丢失。收到图像后摆动自动继续。</translation>
    </message>
    <message>
        <source>NO IMAGES</source>
        <translation>没有图像</translation>
    </message>
    <message>
        <source>STOPPED</source>
        <translation>已停止</translation>
    </message>
    <message>
        <source>READING</source>
        <translation>读取中</translation>
    </message>
    <message>
        <source>NOT SAVED</source>
        <translation>未保存</translation>
    </message>
    <message>
        <source>The tip is now in use.</source>
        <translation>该测头已启用。</translation>
    </message>
    <message>
        <source>{0} of {1} (minimum)</source>
        <translation>{0} / {1}（最少）</translation>
    </message>
    <message>
        <source>{0} of about {1} images</source>
        <translation>{0} / 约 {1} 幅图像</translation>
    </message>
    <message>
        <source>{0} of {1} images loaded</source>
        <translation>已载入 {0} / {1} 幅图像</translation>
    </message>
    <message>
        <source>Enter: review</source>
        <translation>Enter：复核</translation>
    </message>
    <message>
        <source>Space: continue</source>
        <translation>空格：继续</translation>
    </message>
    <message>
        <source>Space: pause</source>
        <translation>空格：暂停</translation>
    </message>
    <message>
        <source>TIP SLIPPED</source>
        <translation>测头滑动</translation>
    </message>
    <message>
        <source>No swing yet</source>
        <translation>尚无摆动</translation>
    </message>
    <message>
        <source>at most {0} images</source>
        <translation>最多 {0} 幅图像</translation>
    </message>
</context>
<context>
    <name>TimeLeft</name>
    <message>
        <source>about {0} min left</source>
        <translation>约剩 {0} 分钟</translation>
    </message>
    <message>
        <source>about {0} s left</source>
        <translation>约剩 {0} 秒</translation>
    </message>
</context>
<context>
    <name>TipSummary</name>
    <message>
        <source>U (k = 2) of the tip in its weakest direction</source>
        <translation>测头在最弱方向上的 U (k = 2)</translation>
    </message>
    <message>
        <source>Tip in the pen frame / mm, U (k = 2)</source>
        <translation>光笔坐标系中的测头 / mm，U (k = 2)</translation>
    </message>
    <message>
        <source>Tip {0} in the frame of pen {1} / mm, U&#xa0;(k&#xa0;=&#xa0;2)</source>
        <translation>光笔 {1} 坐标系中的测头 {0} / mm，U&#xa0;(k&#xa0;=&#xa0;2)</translation>
    </message>
    <message>
        <source>limit {0} mm</source>
        <translation>限值 {0} mm</translation>
    </message>
</context>
<context>
    <name>TrendPanel</name>
    <message>
        <source>{0} / mm with U (k = 2)</source>
        <translation>{0} / mm，含 U (k = 2)</translation>
    </message>
    <message>
        <source>calibration no.</source>
        <translation>标定序号</translation>
    </message>
    <message>
        <source>Largest U (k = 2) / mm</source>
        <translation>最大 U (k = 2) / mm</translation>
    </message>
    <message>
        <source>Select an entry with a tip to see its trend.</source>
        <translation>选择带测头数据的条目以查看其趋势。</translation>
    </message>
    <message>
        <source>Pen {0}, tip {1}: {2} calibrations, {3} to {4}. Dashed: the limit of U. Ten calibrations give control limits.</source>
        <translation>光笔 {0}，测头 {1}：{2} 次标定，{3} 至 {4}。虚线：U 的限值。十次标定后给出控制限。</translation>
    </message>
    <message>
        <source>Pen {0}, tip {1}: {2} calibrations, {3} to {4}. Dashed: mean ± three standard deviations, and the limit of U.</source>
        <translation>光笔 {0}，测头 {1}：{2} 次标定，{3} 至 {4}。虚线：平均值 ± 三倍标准差，以及 U 的限值。</translation>
    </message>
    <message>
        <source>Pen {0}, tip {1}: one calibration, {2}. Dashed: the limit of U.</source>
        <translation>光笔 {0}，测头 {1}：一次标定，{2}。虚线：U 的限值。</translation>
    </message>
</context>
<context>
    <name>UncertaintyPanel</name>
    <message>
        <source>U (k = 2) by source, weakest direction / mm</source>
        <translation>各来源的 U (k = 2)，最弱方向 / mm</translation>
    </message>
    <message>
        <source>Postures: tilt / °</source>
        <translation>姿态：倾角 / °</translation>
    </message>
    <message>
        <source>to the right</source>
        <translation>向右</translation>
    </message>
    <message>
        <source>away from the camera</source>
        <translation>远离相机</translation>
    </message>
    <message>
        <source>Weakest direction: ({0})</source>
        <translation>最弱方向：({0})</translation>
    </message>
    <message>
        <source>Assumed: not stated in file</source>
        <translation>假定：文件中未给出</translation>
    </message>
    <message>
        <source>Images are correlated: noise variance × {0}</source>
        <translation>图像相关：噪声方差 × {0}</translation>
    </message>
</context>
<context>
    <name>VerificationRow</name>
    <message>
        <source>Continue</source>
        <translation>继续</translation>
    </message>
    <message>
        <source>Continue the verification of {0}</source>
        <translation>继续 {0} 的验证</translation>
    </message>
    <message>
        <source>Close this verification as abandoned? Its recorded data remains.</source>
        <translation>将此验证作为放弃结束吗？已记录的数据均保留。</translation>
    </message>
    <message>
        <source>Close the verification of {0}</source>
        <translation>结束 {0} 的验证</translation>
    </message>
    <message>
        <source>Close verification</source>
        <translation>结束验证</translation>
    </message>
    <message>
        <source>Damaged: {0}</source>
        <translation>已损坏：{0}</translation>
    </message>
</context>
<context>
    <name>VerifyPage</name>
    <message>
        <source>Verify</source>
        <translation>验证</translation>
    </message>
</context>
<context>
    <name>VerifyPresenter</name>
    <message>
        <source>Continue (Space)</source>
        <translation>继续（空格）</translation>
    </message>
    <message>
        <source>Pause (Space)</source>
        <translation>暂停（空格）</translation>
    </message>
    <message>
        <source>Space: continue</source>
        <translation>空格：继续</translation>
    </message>
    <message>
        <source>Space: pause</source>
        <translation>空格：暂停</translation>
    </message>
    <message>
        <source>Practice tip {0} of pen {1}, saved {2}</source>
        <translation>光笔 {1} 的练习测头 {0}，保存于 {2}</translation>
    </message>
    <message>
        <source>Verify the current tip on reference artefacts.</source>
        <translation>用参考标准器验证当前测头。</translation>
    </message>
    <message>
        <source>Tip {0} of pen {1}, in use since {2}</source>
        <translation>光笔 {1} 的测头 {0}，自 {2} 起使用</translation>
    </message>
    <message>
        <source>saved as {0}</source>
        <translation>保存为 {0}</translation>
    </message>
    <message>
        <source>No point is recorded yet.</source>
        <translation>尚未记录任何测点。</translation>
    </message>
    <message>
        <source>Finish early</source>
        <translation>提前结束</translation>
    </message>
    <message>
        <source>now</source>
        <translation>进行中</translation>
    </message>
    <message>
        <source>REPEAT</source>
        <translation>重新摆动</translation>
    </message>
    <message>
        <source>Reading images</source>
        <translation>正在读取图像</translation>
    </message>
    <message>
        <source>Enter the value</source>
        <translation>请输入数值</translation>
    </message>
    <message>
        <source>Nothing to verify</source>
        <translation>无法验证</translation>
    </message>
    <message>
        <source>Probe elsewhere</source>
        <translation>请换一处触测</translation>
    </message>
    <message>
        <source>Wait</source>
        <translation>请稍候</translation>
    </message>
    <message>
        <source>Tip verified</source>
        <translation>测头已通过验证</translation>
    </message>
    <message>
        <source>Check needed</source>
        <translation>需检查</translation>
    </message>
    <message>
        <source>Measuring the points in the recorded images.</source>
        <translation>正在测量已录图像中的点。</translation>
    </message>
    <message>
        <source>Reading the current tip.</source>
        <translation>正在读取当前测头。</translation>
    </message>
    <message>
        <source>The camera sends no images. Probing continues when they arrive.</source>
        <translation>相机未发送图像。收到图像后继续触测。</translation>
    </message>
    <message>
        <source>Not verified</source>
        <translation>测头未通过验证</translation>
    </message>
    <message>
        <source>No images</source>
        <translation>无图像</translation>
    </message>
    <message>
        <source>Do now</source>
        <translation>现在执行</translation>
    </message>
    <message>
        <source>Measure a part</source>
        <translation>测量工件</translation>
    </message>
    <message>
        <source>Calibrate again</source>
        <translation>重新标定</translation>
    </message>
    <message>
        <source>Check again</source>
        <translation>再次检查</translation>
    </message>
    <message>
        <source>Paused</source>
        <translation>已暂停</translation>
    </message>
    <message>
        <source>Press Space to continue.</source>
        <translation>按空格键继续。</translation>
    </message>
    <message>
        <source>Nothing moved</source>
        <translation>没有移动</translation>
    </message>
    <message>
        <source>Hold still</source>
        <translation>握住不动</translation>
    </message>
    <message>
        <source>Pick up the pen</source>
        <translation>请拿起光笔</translation>
    </message>
    <message>
        <source>Not recorded</source>
        <translation>未记录</translation>
    </message>
    <message>
        <source>Not counted</source>
        <translation>不计入</translation>
    </message>
    <message>
        <source>READING</source>
        <translation>读取中</translation>
    </message>
    <message>
        <source>NOT READY</source>
        <translation>未就绪</translation>
    </message>
    <message>
        <source>NOT POSSIBLE</source>
        <translation>无法进行</translation>
    </message>
    <message>
        <source>NO IMAGES</source>
        <translation>没有图像</translation>
    </message>
    <message>
        <source>PAUSED</source>
        <translation>已暂停</translation>
    </message>
    <message>
        <source>POINT RECORDED</source>
        <translation>测点已记录</translation>
    </message>
    <message>
        <source>PROBED BEFORE</source>
        <translation>已触测过</translation>
    </message>
    <message>
        <source>STEADY</source>
        <translation>保持稳定</translation>
    </message>
    <message>
        <source>NOT RECORDED</source>
        <translation>未记录</translation>
    </message>
    <message>
        <source>WAITING</source>
        <translation>等待</translation>
    </message>
    <message>
        <source>PEN DETECTED</source>
        <translation>已检测到光笔</translation>
    </message>
</context>
<context>
    <name>WelcomeView</name>
    <message>
        <source>Folder of the recorded images</source>
        <translation>录制图像的文件夹</translation>
    </message>
    <message>
        <source>The tip rests in a cone while the pen is tilted to all sides; a camera observes the LEDs of the pen. The only point of the pen that does not move is the tip centre.</source>
        <translation>测头停在锥孔中，光笔向各个方向倾斜；相机观察光笔的 LED。光笔上唯一不动的点就是测头中心。</translation>
    </message>
    <message>
        <source>Try it with a simulated pen</source>
        <translation>用模拟光笔试一试</translation>
    </message>
    <message>
        <source>The whole procedure without pen, camera or any entry.</source>
        <translation>无需光笔、相机或任何输入即可体验整个流程。</translation>
    </message>
    <message>
        <source>Calibrate from recorded images</source>
        <translation>用已记录的图像标定</translation>
    </message>
    <message>
        <source>Choose a folder. Files of camera and LEDs in it are found.</source>
        <translation>选择一个文件夹，其中的内参文件和 LED 文件会自动找到。</translation>
    </message>
    <message>
        <source>Set up my station</source>
        <translation>设置我的工位</translation>
    </message>
    <message>
        <source>Enter pen and tip, and choose the camera.</source>
        <translation>输入光笔和测头，并选择相机。</translation>
    </message>
    <message>
        <source>A swing is in progress.</source>
        <translation>摆动正在进行。</translation>
    </message>
</context>
<context>
    <name>WithdrawalBar</name>
    <message>
        <source>Revoke this acceptance? The previous result becomes current again. Both stay in the archive.</source>
        <translation>撤销此次接受吗？前一结果将重新成为当前结果。两者都保留在档案库中。</translation>
    </message>
    <message>
        <source>Reason</source>
        <translation>理由</translation>
    </message>
    <message>
        <source>Revoke acceptance</source>
        <translation>撤销接受</translation>
    </message>
    <message>
        <source>Keep acceptance</source>
        <translation>保留接受</translation>
    </message>
</context>
<context>
    <name>Wizard</name>
    <message>
        <source>An internal error occurred. The program can continue; all images are saved. Please send this report to the developers: {0}</source>
        <translation>发生内部错误。程序可继续运行；全部图像已保存。请将此报告发给开发者：{0}</translation>
    </message>
    <message>
        <source>An internal error occurred. The program can continue; all images are saved. No report was written: the disk is full or write-protected.</source>
        <translation>发生内部错误。程序可继续运行；全部图像已保存。无法写入报告：磁盘已满或没有写入权限。</translation>
    </message>
    <message>
        <source>Choose the data folder at Set up station or in the options (F10).</source>
        <translation>请在“设置工位”或选项 (F10) 中选择数据文件夹。</translation>
    </message>
</context>
<context>
    <name>core</name>
    <message>
        <source>({x:g}, {y:g}) px lies outside every image. Correct or remove the line.</source>
        <translation>({x:g}, {y:g}) px 在任何图像之外。请改正或删除该行。</translation>
    </message>
    <message>
        <source>, </source>
        <translation>、</translation>
    </message>
    <message>
        <source>1 column</source>
        <translation>1 列</translation>
    </message>
    <message>
        <source>1 distortion coefficient</source>
        <translation>1 个畸变系数</translation>
    </message>
    <message>
        <source>1 number</source>
        <translation>1 个数</translation>
    </message>
    <message>
        <source>A pen needs {least} to {most} LEDs; the file has {n_leds}. Check that it is the complete file of a pen.</source>
        <translation>光笔需要 {least} 至 {most} 个 LED；文件有 {n_leds} 个。请检查是否为一支光笔的完整文件。</translation>
    </message>
    <message>
        <source>Actual</source>
        <translation>实际值</translation>
    </message>
    <message>
        <source>An archive on a server needs the package psycopg, which is not installed. Install it with: pip install &quot;lightpen[postgres]&quot;.</source>
        <translation>服务器上的档案库需要软件包 psycopg，但尚未安装。请用以下命令安装：pip install &quot;lightpen[postgres]&quot;。</translation>
    </message>
    <message>
        <source>Another program uses the camera {place}. Close that program, or wait a few seconds if it has just ended.</source>
        <translation>另一个程序正在使用相机 {place}。请关闭该程序；如果它刚刚结束，请等待几秒钟。</translation>
    </message>
    <message>
        <source>Aravis is not installed. It drives GigE Vision and USB3 Vision cameras on Linux: apt-get install libaravis-0.8-0</source>
        <translation>未安装 Aravis。它在 Linux 上驱动 GigE Vision 和 USB3 Vision 相机：apt-get install libaravis-0.8-0</translation>
    </message>
    <message>
        <source>Average</source>
        <translation>平均值</translation>
    </message>
    <message>
        <source>Both halves of the swing fit alone, but not together: the residuals are {times:.0f} times larger. Lock zoom, focus and image stabilisation, clamp camera and cone, and repeat the swing.</source>
        <translation>摆动的前后两半各自符合模型，合在一起却不符合：残差为原来的 {times:.0f} 倍。请锁定变焦、对焦和防抖，夹紧相机和锥孔，然后重新摆动。</translation>
    </message>
    <message>
        <source>CSV, a row for each characteristic</source>
        <translation>CSV，每个特性一行</translation>
    </message>
    <message>
        <source>Camera or LEDs were found from these images. They count once: only what was known before them is taken from the files.</source>
        <translation>相机或 LED 是由这些图像求得的。这些图像只计一次：仅采用文件中在此之前已知的内容。</translation>
    </message>
    <message>
        <source>Camera {camera}: {fault}</source>
        <translation>相机 {camera}：{fault}</translation>
    </message>
    <message>
        <source>Capture more images.</source>
        <translation>请采集更多图像。</translation>
    </message>
    <message>
        <source>Check the part, its clamping and its cleanliness; then measure it again.</source>
        <translation>检查工件、装夹和清洁度，然后重新测量。</translation>
    </message>
    <message>
        <source>Cone by the nominal tip / mm</source>
        <translation>按标称测头得到的锥孔 / mm</translation>
    </message>
    <message>
        <source>Cone in the camera frame / mm</source>
        <translation>相机坐标系中的锥孔 / mm</translation>
    </message>
    <message>
        <source>Connection timed out</source>
        <translation>连接超时</translation>
    </message>
    <message>
        <source>Current tip: average</source>
        <translation>当前测头：平均值</translation>
    </message>
    <message>
        <source>Decision</source>
        <translation>判定</translation>
    </message>
    <message>
        <source>Deviation</source>
        <translation>偏差</translation>
    </message>
    <message>
        <source>Digital Calibration Certificate (XML)</source>
        <translation>数字校准证书 (XML)</translation>
    </message>
    <message>
        <source>Drift</source>
        <translation>漂移</translation>
    </message>
    <message>
        <source>Motion of drift reference</source>
        <translation>漂移参考点的移动</translation>
    </message>
    <message>
        <source>Enter the name of the supervisor.</source>
        <translation>请输入主管的姓名。</translation>
    </message>
    <message>
        <source>Bending (part of U when measuring): {assumed:.3f} mm assumed; a press test measures it.</source>
        <translation>弯曲（测量时计入 U）：假定为 {assumed:.3f} mm；压力试验可测出实际值。</translation>
    </message>
    <message>
        <source>Bending (part of U when measuring): {bending:.3f} ± {uncertainty:.3f} mm by press test of {day}, overdue since {due}; at least {assumed:.3f} mm count. Repeat the press test.</source>
        <translation>弯曲（测量时计入 U）：{bending:.3f} ± {uncertainty:.3f} mm（{day} 的压力试验，已于 {due} 到期）；至少按 {assumed:.3f} mm 计算。请重做压力试验。</translation>
    </message>
    <message>
        <source>Bending (part of U when measuring): {bending:.3f} ± {uncertainty:.3f} mm by press test of {day}.</source>
        <translation>弯曲（测量时计入 U）：{bending:.3f} ± {uncertainty:.3f} mm（{day} 的压力试验）。</translation>
    </message>
    <message>
        <source>Brown&apos;s lens model with {n_coefficients} coefficients; cross-validated error {held_out:.4f} px.</source>
        <translation>Brown 镜头模型，{n_coefficients} 个系数；交叉验证误差 {held_out:.4f} px。</translation>
    </message>
    <message>
        <source>Complete the line, or write several tables as one; if it is the last line, the file is cut short.</source>
        <translation>请补全该行，或将多个表格合并为一个；如果是最后一行，则文件不完整。</translation>
    </message>
    <message>
        <source>Cone or camera moved</source>
        <translation>锥孔或相机移动了</translation>
    </message>
    <message>
        <source>Convert the model by colmap model_converter with the output type TXT, and choose its cameras.txt.</source>
        <translation>请用 colmap model_converter 转换模型，输出类型选 TXT，然后选择其中的 cameras.txt。</translation>
    </message>
    <message>
        <source>Entry {number} of leds in {name} is LED {led:g}. List the LEDs from 1 in ascending order, each once.</source>
        <translation>{name} 中 leds 的第 {number} 项是 LED {led:g}。请从 1 开始按升序列出 LED，每个一次。</translation>
    </message>
    <message>
        <source>Entry {number} of the archive {archive} is damaged. Restore the archive from a copy.</source>
        <translation>档案库 {archive} 的第 {number} 个条目已损坏。请从备份恢复档案库。</translation>
    </message>
    <message>
        <source>Error</source>
        <translation>误差</translation>
    </message>
    <message>
        <source>File name too long</source>
        <translation>文件名过长</translation>
    </message>
    <message>
        <source>Fisheye model (Kannala-Brandt); cross-validated error {held_out:.4f} px.</source>
        <translation>鱼眼模型 (Kannala-Brandt)；交叉验证误差 {held_out:.4f} px。</translation>
    </message>
    <message>
        <source>Fixed point: std. deviation along the line of sight</source>
        <translation>固定点：沿视线的标准差</translation>
    </message>
    <message>
        <source>Fixed point: std. deviation perpendicular to the line of sight</source>
        <translation>固定点：垂直于视线的标准差</translation>
    </message>
    <message>
        <source>Form error</source>
        <translation>形状误差</translation>
    </message>
    <message>
        <source>Frame {number} of the video</source>
        <translation>视频第 {number} 帧</translation>
    </message>
    <message>
        <source>From pose {pose} on the tip lies elsewhere in the pen ({tip:.2f} mm) or the pivot before the camera ({pivot:.2f} mm): the tip was replaced or slipped, or cone or tracker moved. Calibrate the poses before it and those from it on from files of their own.</source>
        <translation>从位姿 {pose} 起，测头在光笔中的位置改变 {tip:.2f} mm，或支点在相机前的位置改变 {pivot:.2f} mm：测头被更换或松动，或者锥孔或跟踪器移动过。请将此前和此后的位姿放在单独的文件中分别标定。</translation>
    </message>
    <message>
        <source>GenICam with a vendor&apos;s GenTL producer</source>
        <translation>GenICam，使用厂商的 GenTL 生产者</translation>
    </message>
    <message>
        <source>GigE and USB3 Vision (Aravis)</source>
        <translation>GigE 和 USB3 Vision (Aravis)</translation>
    </message>
    <message>
        <source>Harvesters is not installed. With the GenTL producer of its vendor it drives any GenICam camera: {python} -m pip install harvesters genicam</source>
        <translation>未安装 Harvesters。它通过厂商的 GenTL 生产者驱动任何 GenICam 相机：{python} -m pip install harvesters genicam</translation>
    </message>
    <message>
        <source>If numbers have decimal commas, separate the columns by semicolons.</source>
        <translation>如果数字使用小数逗号，请用分号分隔各列。</translation>
    </message>
    <message>
        <source>Images (CSV)</source>
        <translation>图像 (CSV)</translation>
    </message>
    <message>
        <source>Images excluded manually: {n_excluded}. Include them again, or repeat the swing.</source>
        <translation>已手动剔除 {n_excluded} 幅图像。请恢复这些图像，或重新摆动。</translation>
    </message>
    <message>
        <source>Input/output error</source>
        <translation>输入/输出错误</translation>
    </message>
    <message>
        <source>It holds no intrinsics: choose the file that the calibration of the camera wrote, or calibrate it with a board.</source>
        <translation>其中没有内参：请选择相机标定写出的文件，或用标定板标定相机。</translation>
    </message>
    <message>
        <source>Its folder does not exist. Create the folder, or choose another.</source>
        <translation>所在文件夹不存在。请创建文件夹，或选择其他文件夹。</translation>
    </message>
    <message>
        <source>Its folder is not a folder. Check the path.</source>
        <translation>所在位置不是文件夹。请检查路径。</translation>
    </message>
    <message>
        <source>Its lines differ, so that it is no table. Export the data as one, with the same columns in each line.</source>
        <translation>各行不同，因此不是表格。请将数据导出为表格，每行的列相同。</translation>
    </message>
    <message>
        <source>Kalibr writes a YAML file beside it, with camchain in its name: choose that.</source>
        <translation>Kalibr 会在同一位置写出文件名中含 camchain 的 YAML 文件：请选择该文件。</translation>
    </message>
    <message>
        <source>Keep the tip in the cone for a moment. The program then learns your position.</source>
        <translation>请将测头在锥孔中保持片刻，程序随后会记住您的位置。</translation>
    </message>
    <message>
        <source>Keep the tip pressed into the cone.</source>
        <translation>保持测头压紧在锥孔中。</translation>
    </message>
    <message>
        <source>Kind</source>
        <translation>类型</translation>
    </message>
    <message>
        <source>LED centres</source>
        <translation>LED 中心</translation>
    </message>
    <message>
        <source>LED {led} is listed already on line {line}. Keep the right one, or of a recording one image.</source>
        <translation>LED {led} 已在第 {line} 行列出。请保留正确的一行；若为录制数据，请只保留一幅图像。</translation>
    </message>
    <message>
        <source>LED {led} is noisier than the others: {sigma:.3f} px, usual is {usual:.3f} px; its weight is reduced accordingly. Clean it, and check its brightness and its supply.</source>
        <translation>LED {led} 的噪声高于其他 LED：{sigma:.3f} px，通常为 {usual:.3f} px；已相应降低其权重。请清洁它，并检查亮度和供电。</translation>
    </message>
    <message>
        <source>LED {led} is not detected at its table position. It is covered, off, or its position is wrong.</source>
        <translation>在表中位置检测不到 LED {led}。它被遮挡、熄灭，或位置有误。</translation>
    </message>
    <message>
        <source>LED {led} is not where the LED file has it</source>
        <translation>LED {led} 不在 LED 文件所示的位置</translation>
    </message>
    <message>
        <source>LED {led} of frame {frame} is already given on line {line}. Keep the right one; of several cameras, write a file each.</source>
        <translation>第 {frame} 帧的 LED {led} 已在第 {line} 行给出。请保留正确的一个；若有多台相机，请每台写一个文件。</translation>
    </message>
    <message>
        <source>LED {led} of {name}</source>
        <translation>{name} 的 LED {led}</translation>
    </message>
    <message>
        <source>LED {led} of {name} has no normal, but others have. Give the normals of all LEDs or of none.</source>
        <translation>{name} 的 LED {led} 没有法向量，而其他 LED 有。请给出全部法向量，或都不给。</translation>
    </message>
    <message>
        <source>LED {led} stands where LED {needed} is expected. Number the LEDs from 1 without gaps.</source>
        <translation>应为 LED {needed} 的位置是 LED {led}。请将 LED 从 1 起连续编号。</translation>
    </message>
    <message>
        <source>LEDs do not fit</source>
        <translation>LED 不匹配</translation>
    </message>
    <message>
        <source>LEDs {one} and {other} are exchanged in the LED file</source>
        <translation>LED 文件中 LED {one} 与 {other} 互换</translation>
    </message>
    <message>
        <source>Length: error</source>
        <translation>长度：误差</translation>
    </message>
    <message>
        <source>Lift, probe again</source>
        <translation>抬起，再触测</translation>
    </message>
    <message>
        <source>Limit</source>
        <translation>限值</translation>
    </message>
    <message>
        <source>Line {line} of {name}</source>
        <translation>{name} 第 {line} 行</translation>
    </message>
    <message>
        <source>Line {line} of {name} has {n_cells} cells where line {first_line} has {expected}. {hint}</source>
        <translation>{name} 第 {line} 行有 {n_cells} 个单元格，而第 {first_line} 行有 {expected} 个。{hint}</translation>
    </message>
    <message>
        <source>Line {line} of {name} is not valid XML ({problem}). The file may be cut short: copy or export it again.</source>
        <translation>{name} 第 {line} 行不是有效的 XML（{problem}）。文件可能不完整：请重新复制或导出。</translation>
    </message>
    <message>
        <source>Line {line} of {name} is not valid YAML ({problem}). Check that this is the right file, whole and in a form that the documents list under input files.</source>
        <translation>{name} 第 {line} 行不是有效的 YAML（{problem}）。请确认文件正确、完整，且格式为文档“输入文件”中所列的一种。</translation>
    </message>
    <message>
        <source>Line {line} of {name}: duplicate column {column} in the header. Give each column a unique name, in one line.</source>
        <translation>{name} 第 {line} 行：表头中 {column} 出现两次。请在一行中给每一列不同的名称。</translation>
    </message>
    <message>
        <source>Line {line} of {name}: the quotation marks do not pair up. Remove or complete them.</source>
        <translation>{name} 第 {line} 行：引号不成对。请删除或补全。</translation>
    </message>
    <message>
        <source>Line {line} of {name}: {flaw}</source>
        <translation>{name} 第 {line} 行：{flaw}</translation>
    </message>
    <message>
        <source>Measure the missing features.</source>
        <translation>请测量缺少的要素。</translation>
    </message>
    <message>
        <source>Measured</source>
        <translation>实测</translation>
    </message>
    <message>
        <source>Most centres are outside the image: they extend to ({x:.0f}, {y:.0f}) px; the images have {width} x {height} px. Check the size of the images.</source>
        <translation>多数中心在图像之外：最远到 ({x:.0f}, {y:.0f}) px；图像为 {width} x {height} px。请检查图像尺寸。</translation>
    </message>
    <message>
        <source>Most images show no width of the LEDs: these are clipped at the highest level, or fade towards their edges. Their centres are less certain; U includes this. If they are clipped, close the aperture or shorten the exposure.</source>
        <translation>多数图像未显示 LED 的宽度：LED 在最高灰度处过曝，或向边缘渐暗。其中心的不确定度较大，U 已计入。若为过曝，请减小光圈或缩短曝光时间。</translation>
    </message>
    <message>
        <source>Motive without rigid bodies</source>
        <translation>没有刚体的 Motive 文件</translation>
    </message>
    <message>
        <source>Moves of the drift reference / mm</source>
        <translation>漂移参考点的移动 / mm</translation>
    </message>
    <message>
        <source>NOT PROVEN</source>
        <translation>未证明</translation>
    </message>
    <message>
        <source>Next feature</source>
        <translation>下一要素</translation>
    </message>
    <message>
        <source>Next point</source>
        <translation>下一点</translation>
    </message>
    <message>
        <source>Next: accept the tip.</source>
        <translation>下一步：接受测头。</translation>
    </message>
    <message>
        <source>Next: clamp cone and camera, then repeat the swing.</source>
        <translation>下一步：固定锥孔和相机，然后重新摆动。</translation>
    </message>
    <message>
        <source>Next: repeat the swing with the tip pressed in.</source>
        <translation>下一步：压紧测头，重新摆动。</translation>
    </message>
    <message>
        <source>Next: report the joint fit of the same images.</source>
        <translation>下一步：改为报告同一组图像的联合拟合。</translation>
    </message>
    <message>
        <source>Next: tighten or clamp what moved, then repeat the swing; or use the longer part.</source>
        <translation>下一步：紧固或夹紧移动的部件后重新摆动；或使用较长部分。</translation>
    </message>
    <message>
        <source>No GenTL producer is installed: {variable} names no folder with a file {suffix}. Install the software of the camera, or open its file {suffix}.</source>
        <translation>没有安装 GenTL 生产者：{variable} 指定的文件夹中没有 {suffix} 文件。请安装相机的软件，或打开它的 {suffix} 文件。</translation>
    </message>
    <message>
        <source>No feature of the plan was probed. Probe at least one.</source>
        <translation>未触测计划中的任何要素。请至少触测一个。</translation>
    </message>
    <message>
        <source>No image came for {waited:.1f} s. Check the camera.</source>
        <translation>{waited:.1f} s 内没有收到图像。请检查相机。</translation>
    </message>
    <message>
        <source>No image shows a chessboard of {columns} x {rows} inner corners; the images show {seen_columns} x {seen_rows}. Count the inner corners of the whole board again.</source>
        <translation>没有图像显示内角点为 {columns} x {rows} 的棋盘格；图像显示的是 {seen_columns} x {seen_rows}。请重新数整块标定板的内角点。</translation>
    </message>
    <message>
        <source>No image source</source>
        <translation>无图像来源</translation>
    </message>
    <message>
        <source>No length is given: all lengths are in hundredths of the largest distance between two LEDs.</source>
        <translation>未给出长度：所有长度以两个 LED 间最大距离的百分之一为单位。</translation>
    </message>
    <message>
        <source>No measuring plan is chosen. Open a plan, or measure without one.</source>
        <translation>未选择测量计划。请打开测量计划，或不使用计划测量。</translation>
    </message>
    <message>
        <source>No nominal tip is specified to compare with.</source>
        <translation>未指定可供比较的标称测头。</translation>
    </message>
    <message>
        <source>No single mistake explains it. Check in this order: that the LED file belongs to this pen, the intrinsics file to this camera, lens and focus, and that no LED is blurred or reflected.</source>
        <translation>没有单一错误能解释。请依次检查：LED 文件是否属于这支光笔，内参文件是否属于这台相机、镜头和对焦，以及 LED 是否模糊或有反光。</translation>
    </message>
    <message>
        <source>No space left on device</source>
        <translation>设备上没有空间</translation>
    </message>
    <message>
        <source>No such file or directory</source>
        <translation>没有那个文件或目录</translation>
    </message>
    <message>
        <source>Nominal</source>
        <translation>标称</translation>
    </message>
    <message>
        <source>Nominal tip: average</source>
        <translation>标称测头：平均值</translation>
    </message>
    <message>
        <source>None of the {n_images} images can be read. {why}</source>
        <translation>{n_images} 幅图像都无法读取。{why}</translation>
    </message>
    <message>
        <source>Not a directory</source>
        <translation>不是目录</translation>
    </message>
    <message>
        <source>OK</source>
        <translation>合格</translation>
    </message>
    <message>
        <source>OUT OF TOLERANCE</source>
        <translation>超差</translation>
    </message>
    <message>
        <source>One swing does not show changes of a pen; give at least two.</source>
        <translation>一次摆动无法显示光笔的变化；请至少给出两次。</translation>
    </message>
    <message>
        <source>Only {n_used} of {n_images} images agree on one tip. Press the tip into the cone, clamp cone and camera, lock zoom and focus, and repeat the swing.</source>
        <translation>{n_images} 幅图像中只有 {n_used} 幅对应同一测头位置。请将测头压入锥孔，夹紧锥孔和相机，锁定变焦和对焦，然后重新摆动。</translation>
    </message>
    <message>
        <source>Only {n_used} of {n_poses} poses agree on one tip and pivot: the tip was replaced or slipped, or cone or tracker moved. The others are {others}. Calibrate each part from a file of its own.</source>
        <translation>{n_poses} 个位姿中只有 {n_used} 个对应同一测头和支点：测头被更换或松动，或者锥孔或跟踪器移动过。其余为 {others}。请将各部分放在单独的文件中分别标定。</translation>
    </message>
    <message>
        <source>Operation not permitted</source>
        <translation>不允许的操作</translation>
    </message>
    <message>
        <source>P</source>
        <translation>P</translation>
    </message>
    <message>
        <source>PLUS (XML)</source>
        <translation>PLUS (XML)</translation>
    </message>
    <message>
        <source>Part</source>
        <translation>工件</translation>
    </message>
    <message>
        <source>Permission denied</source>
        <translation>权限不够</translation>
    </message>
    <message>
        <source>Permission is denied. Choose another folder, or ask for access.</source>
        <translation>没有权限。请选择其他文件夹，或申请权限。</translation>
    </message>
    <message>
        <source>Points excluded because they lie elsewhere: {n_left_out} of {n_touches}, the first {first}. The pen was lifted or slipped.</source>
        <translation>{n_touches} 个测点中有 {n_left_out} 个位于别处而被剔除，第一个是 {first}：光笔被抬起或滑动。</translation>
    </message>
    <message>
        <source>Port {port} is in use already, by another window or another program. Choose another port, or close that one.</source>
        <translation>端口 {port} 已被另一个窗口或程序占用。请选择其他端口，或关闭那个程序。</translation>
    </message>
    <message>
        <source>Press the tip into the cone and keep it there.</source>
        <translation>把测头压入锥孔并保持。</translation>
    </message>
    <message>
        <source>Press the tip into the cone and swing the pen gently.</source>
        <translation>把测头压入锥孔，轻轻摆动光笔。</translation>
    </message>
    <message>
        <source>Probe more points, or use a precise probing, for a smaller U.</source>
        <translation>触测更多点，或采用更精密的触测，以减小 U。</translation>
    </message>
    <message>
        <source>Probe the cone</source>
        <translation>触测锥孔</translation>
    </message>
    <message>
        <source>Probe the cone between the other tasks</source>
        <translation>在其他任务之间触测锥孔</translation>
    </message>
    <message>
        <source>Probe the cone upright</source>
        <translation>光笔竖直，触测锥孔</translation>
    </message>
    <message>
        <source>Probe the feature</source>
        <translation>触测要素</translation>
    </message>
    <message>
        <source>Probed points in the camera frame / mm</source>
        <translation>相机坐标系中的测点 / mm</translation>
    </message>
    <message>
        <source>Q-DAS (AQDEF)</source>
        <translation>Q-DAS (AQDEF)</translation>
    </message>
    <message>
        <source>QIF 3.0 results</source>
        <translation>QIF 3.0 结果</translation>
    </message>
    <message>
        <source>RMS residual {sigma:.2f} px; usual is {usual:g} px or less. Check that the LED file belongs to this pen and the intrinsics file to this camera and lens.</source>
        <translation>残差 RMS {sigma:.2f} px；通常不超过 {usual:g} px。请检查 LED 文件是否属于此光笔，内参文件是否属于此相机和镜头。</translation>
    </message>
    <message>
        <source>ROS (YAML)</source>
        <translation>ROS (YAML)</translation>
    </message>
    <message>
        <source>RadialDistortion in {name} has {counted} where 2 or 3 are needed. Correct it, or export the file again.</source>
        <translation>{name} 中的 RadialDistortion 有 {counted}，需要 2 或 3 个。请改正，或重新导出文件。</translation>
    </message>
    <message>
        <source>Radius error</source>
        <translation>半径误差</translation>
    </message>
    <message>
        <source>Range</source>
        <translation>极差</translation>
    </message>
    <message>
        <source>Read-only file system</source>
        <translation>只读文件系统</translation>
    </message>
    <message>
        <source>Record (JSON)</source>
        <translation>记录 (JSON)</translation>
    </message>
    <message>
        <source>Recorded images</source>
        <translation>录制的图像</translation>
    </message>
    <message>
        <source>Relative error × 1e-4</source>
        <translation>相对误差 × 1e-4</translation>
    </message>
    <message>
        <source>Repeatability: std. deviation of the tip</source>
        <translation>重复性：测头标准差</translation>
    </message>
    <message>
        <source>Required - current tip</source>
        <translation>所需测头 - 当前测头</translation>
    </message>
    <message>
        <source>Residuals {sigma:.2f} px; usual is {usual:.2f} px or less. {cause}</source>
        <translation>残差 {sigma:.2f} px；通常不超过 {usual:.2f} px。{cause}</translation>
    </message>
    <message>
        <source>Scale of the pen: adds {added:.2f} mm per metre (U) to what is measured, as temperature or thermal expansion of the pen are not stated. State both.</source>
        <translation>光笔的比例：由于未给出光笔的温度或热膨胀系数，测量结果每米增加 {added:.2f} mm (U)。请给出这两项。</translation>
    </message>
    <message>
        <source>Scale of the pen: adds {added:.2f} mm per metre (U) to what is measured.</source>
        <translation>光笔的比例：测量结果每米增加 {added:.2f} mm (U)。</translation>
    </message>
    <message>
        <source>Simulated pen</source>
        <translation>模拟光笔</translation>
    </message>
    <message>
        <source>Size</source>
        <translation>尺寸</translation>
    </message>
    <message>
        <source>Standard uncertainty of points in between along u, v, w: {u:.4f}, {v:.4f}, {w:.4f} mm.</source>
        <translation>其间测点在 u、v、w 方向的标准不确定度：{u:.4f}、{v:.4f}、{w:.4f} mm。</translation>
    </message>
    <message>
        <source>Std. deviation</source>
        <translation>标准差</translation>
    </message>
    <message>
        <source>Streaming needs the package pyigtl, which is not installed. Install it with: pip install &quot;lightpen[stream]&quot;.</source>
        <translation>实时数据流需要 pyigtl 软件包，但尚未安装。安装命令：pip install &quot;lightpen[stream]&quot;。</translation>
    </message>
    <message>
        <source>Swing: max. U (k = 2)</source>
        <translation>摆动：U (k = 2) 上限</translation>
    </message>
    <message>
        <source>Swing: max. images</source>
        <translation>摆动：最多图像数</translation>
    </message>
    <message>
        <source>Swing: min. images</source>
        <translation>摆动：最少图像数</translation>
    </message>
    <message>
        <source>The LEDs move by {size:.3f} px (RMS) against each other with the tilt of the pen: it bends under its weight, or LEDs are loose. The result is corrected and U includes the rest. Stiffen the pen, and check how the LEDs are fixed.</source>
        <translation>各 LED 随光笔倾斜相互移动 {size:.3f} px（均方根）：光笔因自重弯曲，或 LED 松动。结果已修正，其余部分计入 U。请加固光笔，并检查 LED 的固定。</translation>
    </message>
    <message>
        <source>The LEDs span only {extent:.4g} mm, less than one disc of {diameter:g} mm. If the coordinates are in metres or inches, state the unit, for example in the header: x_m, y_m, z_m.</source>
        <translation>LED 的跨度仅 {extent:.4g} mm，小于一个 {diameter:g} mm 的圆盘。若坐标单位为米或英寸，请注明单位，例如在表头写：x_m, y_m, z_m。</translation>
    </message>
    <message>
        <source>The archive contains entries of another chain, {chain}.</source>
        <translation>档案中含有另一条链 {chain} 的条目。</translation>
    </message>
    <message>
        <source>The archive is closed: the program ends.</source>
        <translation>档案库已关闭：程序正在结束。</translation>
    </message>
    <message>
        <source>The archive {archive} lacks entry {number}, which was entered in this user account: it was removed, or replaced by an older copy. Nothing is accepted until it is restored, or fetched from the server. To begin anew without it, an administrator removes {memory}.</source>
        <translation>档案库 {archive} 缺少第 {number} 条，该条目曾在此用户账户中录入：它已被移除，或被较旧的副本替换。在恢复或从服务器取回之前，不接受任何结果。若要在没有它的情况下重新开始，由管理员删除 {memory}。</translation>
    </message>
    <message>
        <source>The base of the rig file and the scale of the LED file contradict each other: the pen is {wanted:.6g} ± {wanted_u:.2g} times as large by the rig, 1 ± {stated_u:.2g} by its file (k = 2). Either file may be wrong. Check that both belong together, then measure the pen or calibrate the rig again.</source>
        <translation>相机组文件的基线与 LED 文件的尺度相互矛盾：按相机组，光笔为 {wanted:.6g} ± {wanted_u:.2g} 倍，按其文件为 1 ± {stated_u:.2g} (k = 2)。任一文件都可能有误。请检查两者是否配套，然后重新测量光笔或标定相机组。</translation>
    </message>
    <message>
        <source>The calibrator writes an ost.yaml beside it: choose that.</source>
        <translation>标定程序会在同一位置写出 ost.yaml：请选择该文件。</translation>
    </message>
    <message>
        <source>The camera matrix of {name} is not of the form fx 0 cx, 0 fy cy, 0 0 1; it may be transposed or incomplete. Export the file again.</source>
        <translation>{name} 的相机矩阵不是 fx 0 cx, 0 fy cy, 0 0 1 的形式；可能被转置或不完整。请重新导出文件。</translation>
    </message>
    <message>
        <source>The chain {chain} is not known in this user account: it was begun in another one. Compare its name with that on earlier reports.</source>
        <translation>此用户账户不认识链 {chain}：它是在另一账户中开始的。请将其名称与以前报告上的名称核对。</translation>
    </message>
    <message>
        <source>The disc diameter is not checked by this calibration: LED centres alone show little of it.</source>
        <translation>本次标定不检验发光面直径：仅有 LED 中心几乎无法显示它。</translation>
    </message>
    <message>
        <source>The disk is full. Free some space, or write to another disk.</source>
        <translation>磁盘已满。请清理空间，或写到其他磁盘。</translation>
    </message>
    <message>
        <source>The disk is read-only. Choose another folder.</source>
        <translation>磁盘是只读的。请选择其他文件夹。</translation>
    </message>
    <message>
        <source>The drift reference seems to have moved by {distance:.4f} mm (U {uncertainty:.4f} mm, limit {limit:.4f} mm), which noise alone explains.</source>
        <translation>漂移参考点似乎移动了 {distance:.4f} mm（U {uncertainty:.4f} mm，限值 {limit:.4f} mm），仅噪声即可解释。</translation>
    </message>
    <message>
        <source>The file would be larger than allowed here. Write to another disk.</source>
        <translation>文件超过此处允许的大小。请写到其他磁盘。</translation>
    </message>
    <message>
        <source>The file {file} is damaged: {what}.</source>
        <translation>文件 {file} 已损坏：{what}。</translation>
    </message>
    <message>
        <source>The file {file} is not entered in the archive and does not count.</source>
        <translation>文件 {file} 未录入档案库，不生效。</translation>
    </message>
    <message>
        <source>The file {file} names a supervisor who did not approve it, or needs one. It does not count.</source>
        <translation>文件 {file} 所列主管并未批准它，或它需要主管批准。它不生效。</translation>
    </message>
    <message>
        <source>The file {file} of entry {number} in the archive is missing. Nothing is accepted until it is restored from a copy, or fetched from the server.</source>
        <translation>档案库第 {number} 条的文件 {file} 缺失。在从副本恢复或从服务器取回之前，不接受任何结果。</translation>
    </message>
    <message>
        <source>The file {file} of entry {number} is missing.</source>
        <translation>第 {number} 个条目的文件 {file} 缺失。</translation>
    </message>
    <message>
        <source>The file {file} of the tip library was written by a later version of the program. Use that version.</source>
        <translation>测头库文件 {file} 由更新版本的程序写成。请使用该版本。</translation>
    </message>
    <message>
        <source>The file {file} was changed after it was entered in the archive as entry {number}. Nothing is accepted until it is restored from a copy.</source>
        <translation>文件 {file} 在作为第 {number} 条录入档案库之后被更改。在从副本恢复之前，不接受任何结果。</translation>
    </message>
    <message>
        <source>The file {file} was changed before it was entered in the archive. Nothing is accepted until it is restored from a copy.</source>
        <translation>文件 {file} 在录入档案库之前被更改。在从副本恢复之前，不接受任何结果。</translation>
    </message>
    <message>
        <source>The first camera of {name}, {camera}, is the reference of the rig: its cam_from_rig must be the identity. List the reference camera first, and give the others from its frame.</source>
        <translation>{name} 中的第一台相机 {camera} 是相机组的基准：其 cam_from_rig 必须是单位变换。请把基准相机列在第一位，其余相机均相对于它的坐标系给出。</translation>
    </message>
    <message>
        <source>The folder {folder} contains no files. Choose the folder with the images.</source>
        <translation>文件夹 {folder} 中没有文件。请选择包含图像的文件夹。</translation>
    </message>
    <message>
        <source>The header of {name} asks players to turn its frames by {degrees} degrees. This is not applied: the frames are used as stored, which must be the orientation that the intrinsics file was made for.</source>
        <translation>{name} 的文件头要求播放器把画面旋转 {degrees} 度。程序不执行这一旋转：画面按存储的方向使用，内参文件必须是在这一方向上标定的。</translation>
    </message>
    <message>
        <source>The images agree with the files once one of these is corrected: {causes}.</source>
        <translation>改正以下任一项后图像与文件相符：{causes}。</translation>
    </message>
    <message>
        <source>The images agree with the files once this is corrected: {causes}.</source>
        <translation>改正以下一项后图像与文件相符：{causes}。</translation>
    </message>
    <message>
        <source>The images are from two cameras, or were taken with two settings of zoom or focus: {one}; {other}. Use images of one camera, with zoom and focus locked.</source>
        <translation>图像来自两台相机，或以两种变焦或对焦设置拍摄：{one}；{other}。请使用同一相机、锁定变焦和对焦后的图像。</translation>
    </message>
    <message>
        <source>The images are turned by 180 degrees against the intrinsics file: its principal point agrees with them only if they are turned back. Use images as the camera delivers them, or the intrinsics of the camera mounted like this.</source>
        <translation>图像相对于内参文件旋转了 180 度：只有转回来，文件中的主点才与图像相符。请使用相机原样输出的图像，或使用按此安装方式标定的相机内参。</translation>
    </message>
    <message>
        <source>The joint fit did not converge. {cause}</source>
        <translation>联合拟合未收敛。{cause}</translation>
    </message>
    <message>
        <source>The limits in {file} were not approved by a supervisor of this station. Nothing is accepted until the file is removed.</source>
        <translation>{file} 中的限值未经本工位主管批准。在移除该文件之前，不接受任何结果。</translation>
    </message>
    <message>
        <source>The name is a link that leads back to itself. Choose another name.</source>
        <translation>该名称是指向自身的链接。请另选名称。</translation>
    </message>
    <message>
        <source>The name is too long. Choose a shorter one.</source>
        <translation>名称太长。请选择较短的名称。</translation>
    </message>
    <message>
        <source>The normal of LED {led} points away from the viewer (nz = {nz:.3f}); nz must be positive in the pen frame. Change its sign.</source>
        <translation>LED {led} 的法向量背向观察者 (nz = {nz:.3f})；在光笔坐标系中 nz 必须为正。请改变其符号。</translation>
    </message>
    <message>
        <source>The numbers in the names repeat in {n_series} series, as in {first} and {second}. If they are images of several cameras, put those of each into a folder of its own: together they look like a pen that slips or a cone that moves.</source>
        <translation>文件名中的编号在 {n_series} 个系列中重复，例如 {first} 和 {second}。如果图像来自多台相机，请将每台的图像放入各自的文件夹：混在一起看起来像测尖打滑或锥孔移动。</translation>
    </message>
    <message>
        <source>The path of the video {path} is no valid UTF-8, which the video decoder needs. Rename the video or its folder, or copy it elsewhere.</source>
        <translation>视频路径 {path} 不是有效的 UTF-8，视频解码器无法使用。请重命名视频或其文件夹，或将其复制到别处。</translation>
    </message>
    <message>
        <source>The plan has no feature {name}. Its features are: {names}. Name the probed points after a feature.</source>
        <translation>计划中没有要素 {name}。其要素为：{names}。请按要素命名测点。</translation>
    </message>
    <message>
        <source>The point scatters, std. deviation {deviation:.4f} mm along {axis} (at most {limit:.4f} mm is allowed or expected by noise), which no other tip position explains. The tip may not rest in the cone: look for dirt, wear and a loose cone.</source>
        <translation>点的散布沿 {axis} 的标准差为 {deviation:.4f} mm（允许或按噪声预期不超过 {limit:.4f} mm），其他测头位置无法解释。测头可能未就位于锥孔：请检查污物、磨损和锥座松动。</translation>
    </message>
    <message>
        <source>The program failed on this image ({kind}: {problem}). Keep the image, and report it.</source>
        <translation>程序处理该图像时出错（{kind}: {problem}）。请保留该图像并反馈此问题。</translation>
    </message>
    <message>
        <source>The projection is uncertain by {px:.1f} px over the image: the views do not determine the camera. Add views with the board tilted by 20° to 40° to each side, and in each corner of the image.</source>
        <translation>整幅图像的投影不确定度为 {px:.1f} px：各视图不足以确定相机。请补拍标定板向各侧倾斜 20° 至 40° 以及位于图像各角的视图。</translation>
    </message>
    <message>
        <source>The record of {entry} is missing.</source>
        <translation>{entry}的标定数据缺失。</translation>
    </message>
    <message>
        <source>The record {record} of {entries} was changed in the archive.</source>
        <translation>{entries}的标定数据 {record} 在档案库中被改动过。</translation>
    </message>
    <message>
        <source>The recorded images are {found}, not {wanted}. Choose {found}.</source>
        <translation>录制的图像为 {found}，而不是 {wanted}。请选择 {found}。</translation>
    </message>
    <message>
        <source>The result {file} is not the one that was entered in the archive: it was changed since. Restore it from a copy.</source>
        <translation>结果 {file} 与档案中登记的不一致：登记之后被更改过。请从备份恢复。</translation>
    </message>
    <message>
        <source>The scale of the LED file is not checked by this calibration, nor is its disc diameter, which LED centres alone do not show. Verify a known length.</source>
        <translation>本次标定不检验 LED 文件的尺度，也不检验其发光面直径，仅有 LED 中心无法显示后者。请用已知长度验证。</translation>
    </message>
    <message>
        <source>The scale of the LED file is not checked by this calibration. Verify a known length.</source>
        <translation>本次标定不检验 LED 文件的尺度。请用已知长度验证。</translation>
    </message>
    <message>
        <source>The swing does not fit the intrinsics file. Check that the file is of this camera, zoom and focus, or find the camera without a file.</source>
        <translation>摆动与内参文件不符。请检查文件是否属于这台相机及其变焦和对焦，或在没有文件的情况下求出相机。</translation>
    </message>
    <message>
        <source>The swing of the result {file} is not in {folder}. Copy it back there, then open the result again.</source>
        <translation>标定结果 {file} 对应的摆动记录不在 {folder} 中。请将其复制回该处，然后重新打开该结果。</translation>
    </message>
    <message>
        <source>The swing {folder} of entry {number} is missing.</source>
        <translation>第 {number} 个条目的摆动 {folder} 缺失。</translation>
    </message>
    <message>
        <source>The tip cannot be accepted. {why}</source>
        <translation>不能接受该测头。{why}</translation>
    </message>
    <message>
        <source>The tip moved in the pen</source>
        <translation>测头在光笔中移动了</translation>
    </message>
    <message>
        <source>The translations are about {typical:.3g} long: they are taken as metres.</source>
        <translation>平移量约为 {typical:.3g}：按米处理。</translation>
    </message>
    <message>
        <source>The two bytes of each value in {name} are probably exchanged, by its levels. Save the images with the bytes in the order that their format states.</source>
        <translation>从灰度值看，{name} 中每个值的两个字节可能颠倒了。请按图像格式规定的字节顺序保存图像。</translation>
    </message>
    <message>
        <source>The video {path} has uncompressed frames, which are not read from videos. Save its frames as images: PNG or TIFF, of 16 bits where the video has more than 8. Of 8 bits, it may be converted to FFV1, which loses nothing.</source>
        <translation>视频 {path} 的画面未压缩，程序不读取这种视频。请把画面保存为 PNG 或 TIFF 图像；视频超过 8 位时，请用 16 位图像。8 位视频也可无损转换为 FFV1。</translation>
    </message>
    <message>
        <source>The {kind} {name} does not show the normal of its surface, along which the ball is compensated. In the plan name the plane it lies on (&apos;surface: NAME&apos;), give the normal out of the material (&apos;normal: [x, y, z]&apos; in the part&apos;s frame), probe that plane too, or state &apos;side: centre&apos; for the ball centre itself.</source>
        <translation>{kind} {name} 未显示其表面法线，无法沿法线补偿测球。请在方案中指定其所在平面（‘surface: NAME’），给出指向材料外的法线（‘normal: [x, y, z]’，零件坐标系），或再触测该平面，或用 ‘side: centre’ 表示测球中心本身。</translation>
    </message>
    <message>
        <source>The {what} of this camera cannot be set. Use the aperture of the lens.</source>
        <translation>此相机的{what}无法设定。请使用镜头光圈。</translation>
    </message>
    <message>
        <source>The {what} of {name} is not a covariance matrix: it must be symmetric with no negative variance. Correct or remove it.</source>
        <translation>{name} 的 {what} 不是协方差矩阵：它必须对称且没有负方差。请更正或删除。</translation>
    </message>
    <message>
        <source>The {what} {path} is a file of the kind {kind}, which is not read. Export its content as text, in a form that the documents list under input files.</source>
        <translation>{what} {path} 是 {kind} 类型的文件，无法读取。请将其内容导出为文本，格式见文档的“输入文件”一节。</translation>
    </message>
    <message>
        <source>There is a file of that name already. Try again.</source>
        <translation>已有同名文件。请重试。</translation>
    </message>
    <message>
        <source>There is no camera {place}{why}. Check its power, its cable and its address, then search again.</source>
        <translation>没有相机 {place}{why}。请检查电源、线缆和地址，然后重新搜索。</translation>
    </message>
    <message>
        <source>There is no {kind} {id} in the library. Add it first.</source>
        <translation>测头库中没有{kind} {id}。请先添加。</translation>
    </message>
    <message>
        <source>This place was probed before. Probe elsewhere.</source>
        <translation>此处已触测过。请触测别处。</translation>
    </message>
    <message>
        <source>Tip (CSV)</source>
        <translation>测球中心 (CSV)</translation>
    </message>
    <message>
        <source>Tip (text)</source>
        <translation>测球中心（文本）</translation>
    </message>
    <message>
        <source>Tip check</source>
        <translation>测头检查</translation>
    </message>
    <message>
        <source>Tip comparison / mm</source>
        <translation>测头比较 / mm</translation>
    </message>
    <message>
        <source>Tip: calibration interval (days)</source>
        <translation>测头：标定周期（天）</translation>
    </message>
    <message>
        <source>Too many levels of symbolic links</source>
        <translation>符号链接的层数过多</translation>
    </message>
    <message>
        <source>Too many open files</source>
        <translation>打开的文件过多</translation>
    </message>
    <message>
        <source>U (k = 2)</source>
        <translation>U (k = 2)</translation>
    </message>
    <message>
        <source>U (k = 2) of average</source>
        <translation>平均值的 U (k = 2)</translation>
    </message>
    <message>
        <source>U (k = 2) of difference</source>
        <translation>差值的 U (k = 2)</translation>
    </message>
    <message>
        <source>U (k = 2) of the tip is {uncertainty:.4f} mm in its weakest direction, limit {limit:.4f} mm; {share:.4f} mm due to a camera that may turn as the operator moves, or a sideways push that bends the stylus. Capture more images; if that does not help, put the camera on a firm stand where steps do not move it, and let the weight of the pen press the tip.</source>
        <translation>测头在最弱方向上的 U (k = 2) 为 {uncertainty:.4f} mm，限值 {limit:.4f} mm。其中 {share:.4f} mm 来自相机可能随操作员移动而转动，或侧向推力使测针弯曲。请采集更多图像；若仍无改善，请将相机置于脚步不会影响的稳固支架上，并仅靠光笔自重压住测头。</translation>
    </message>
    <message>
        <source>U (k = 2) of the tip is {uncertainty:.4f} mm in its weakest direction. {what}</source>
        <translation>测头在最弱方向上的 U (k = 2) 为 {uncertainty:.4f} mm。{what}</translation>
    </message>
    <message>
        <source>U (k = 2) of the two-stage tip is {uncertainty:.4f} mm in its weakest direction, limit {limit:.4f} mm: it is {distance:.4f} mm off the joint fit, {bias:.4f} mm by the projection of the discs. Report the joint fit.</source>
        <translation>两步法测头在最弱方向上的 U (k = 2) 为 {uncertainty:.4f} mm，限值为 {limit:.4f} mm：它与联合拟合相差 {distance:.4f} mm，其中 {bias:.4f} mm 来自发光面的投影。请报告联合拟合。</translation>
    </message>
    <message>
        <source>U {axis}</source>
        <translation>{axis} 的 U</translation>
    </message>
    <message>
        <source>Verifies the tip: had it an error of {detectable:.4f} mm or more, this verification would show it (probability 95 %).</source>
        <translation>测头已验证：若测头误差达到 {detectable:.4f} mm 或更大，本次验证会显示出来（概率 95 %）。</translation>
    </message>
    <message>
        <source>Write image size, camera matrix and distortion coefficients as text: by jsonencode in MATLAB, by cv2.FileStorage in Python.</source>
        <translation>请将图像尺寸、相机矩阵和畸变系数写成文本：MATLAB 用 jsonencode，Python 用 cv2.FileStorage。</translation>
    </message>
    <message>
        <source>Write the matrix and the distortion of the camera that observes the pen as camera_matrix and distortion_coefficients, with image_width and image_height.</source>
        <translation>请将观测光笔的那台相机的矩阵和畸变写成 camera_matrix 和 distortion_coefficients，并写明 image_width 和 image_height。</translation>
    </message>
    <message>
        <source>Your disk quota is used up. Free some space, or write elsewhere.</source>
        <translation>磁盘配额已用完。请清理空间，或写到其他地方。</translation>
    </message>
    <message>
        <source>a Digital Calibration Certificate in the schema of PTB; it names the laboratory</source>
        <translation>符合 PTB 模式的数字校准证书；其中注明实验室</translation>
    </message>
    <message>
        <source>a TransformStamped of ROS, in metres</source>
        <translation>ROS 的 TransformStamped，单位为米</translation>
    </message>
    <message>
        <source>a table of one row: names, tip, U (k = 2), origin and grade</source>
        <translation>单行表格：名称、测球中心、U (k = 2)、来源和等级</translation>
    </message>
    <message>
        <source>a table with a row for each image</source>
        <translation>每幅图像一行的表格</translation>
    </message>
    <message>
        <source>ball centre</source>
        <translation>球心</translation>
    </message>
    <message>
        <source>camera {number} of {name}</source>
        <translation>{name} 中的第 {number} 台相机</translation>
    </message>
    <message>
        <source>diameter of the discs</source>
        <translation>发光面的直径</translation>
    </message>
    <message>
        <source>file</source>
        <translation>文件</translation>
    </message>
    <message>
        <source>fx {fx:.1f}, cx {cx:.1f}, cy {cy:.1f} px in {n_views} views ({names})</source>
        <translation>{n_views} 个视图（{names}）中 fx {fx:.1f}、cx {cx:.1f}、cy {cy:.1f} px</translation>
    </message>
    <message>
        <source>mostly at the lower left of the pen&apos;s region in the image</source>
        <translation>多在图像中光笔区域的左下部</translation>
    </message>
    <message>
        <source>mostly at the lower right of the pen&apos;s region in the image</source>
        <translation>多在图像中光笔区域的右下部</translation>
    </message>
    <message>
        <source>mostly at the upper left of the pen&apos;s region in the image</source>
        <translation>多在图像中光笔区域的左上部</translation>
    </message>
    <message>
        <source>mostly at the upper right of the pen&apos;s region in the image</source>
        <translation>多在图像中光笔区域的右上部</translation>
    </message>
    <message>
        <source>mostly of LED {led}</source>
        <translation>多属 LED {led}</translation>
    </message>
    <message>
        <source>mostly of LEDs {leds}</source>
        <translation>多属 LED {leds}</translation>
    </message>
    <message>
        <source>no image</source>
        <translation>无图像</translation>
    </message>
    <message>
        <source>outside the part that is used</source>
        <translation>不在所用部分之内</translation>
    </message>
    <message>
        <source>plan</source>
        <translation>方案</translation>
    </message>
    <message>
        <source>rig file</source>
        <translation>相机组文件</translation>
    </message>
    <message>
        <source>scale of the LEDs</source>
        <translation>LED 坐标的尺度</translation>
    </message>
    <message>
        <source>shown mirrored left to right</source>
        <translation>左右镜像显示</translation>
    </message>
    <message>
        <source>shown mirrored top to bottom</source>
        <translation>上下镜像显示</translation>
    </message>
    <message>
        <source>shown turned by 180 degrees</source>
        <translation>旋转 180 度显示</translation>
    </message>
    <message>
        <source>shown turned by 90 degrees and mirrored</source>
        <translation>旋转 90 度并镜像显示</translation>
    </message>
    <message>
        <source>shown turned by 90 degrees to the left</source>
        <translation>向左旋转 90 度显示</translation>
    </message>
    <message>
        <source>shown turned by 90 degrees to the right</source>
        <translation>向右旋转 90 度显示</translation>
    </message>
    <message>
        <source>spread over LEDs and image</source>
        <translation>分布于各 LED 和整个图像</translation>
    </message>
    <message>
        <source>straightness</source>
        <translation>直线度</translation>
    </message>
    <message>
        <source>the LED file is a mirror image of the pen (sign of x or of y, or x and y exchanged), or the images are mirrored (ReverseX, ReverseY)</source>
        <translation>LED 文件为光笔的镜像（x 或 y 的符号，或 x 与 y 互换），或图像为镜像（ReverseX、ReverseY）</translation>
    </message>
    <message>
        <source>the LED file is a mirror image of the pen (sign of z)</source>
        <translation>LED 文件为光笔的镜像（z 的符号）</translation>
    </message>
    <message>
        <source>the diameter of the LED discs. State it and its uncertainty in the LED file</source>
        <translation>LED 发光面的直径。请在 LED 文件中给出直径及其不确定度</translation>
    </message>
    <message>
        <source>the disc diameter in the LED file ({factor:g} times {diameter:g} mm) or the unit of its coordinates</source>
        <translation>LED 文件中的发光面直径（{diameter:g} mm 的 {factor:g} 倍）或坐标单位</translation>
    </message>
    <message>
        <source>the file has decimal points and decimal commas; the other form is on line {line}. Use one form throughout.</source>
        <translation>文件同时含有小数点和小数逗号；另一种形式在第 {line} 行。请统一使用一种形式。</translation>
    </message>
    <message>
        <source>the focal length in the intrinsics file (times about {factor:g})</source>
        <translation>内参文件中的焦距（约 {factor:g} 倍）</translation>
    </message>
    <message>
        <source>the images are binned by 2, the intrinsics file is not</source>
        <translation>图像按 2 合并像素，而内参文件没有</translation>
    </message>
    <message>
        <source>the images are cropped (principal point off by {x:.0f}, {y:.0f} px)</source>
        <translation>图像经过裁剪（主点偏移 {x:.0f}、{y:.0f} px）</translation>
    </message>
    <message>
        <source>the images are mirrored left to right</source>
        <translation>图像左右镜像</translation>
    </message>
    <message>
        <source>the intrinsics file is for images binned by 2</source>
        <translation>内参文件属于按 2 合并像素的图像</translation>
    </message>
    <message>
        <source>the omnidirectional lens model (xi)</source>
        <translation>全向镜头模型 (xi)</translation>
    </message>
    <message>
        <source>the unit of the LED file (its coordinates times {factor:g} are mm)</source>
        <translation>LED 文件的单位（坐标乘以 {factor:g} 为 mm）</translation>
    </message>
    <message>
        <source>the {kind} {name}</source>
        <translation>{kind} {name}</translation>
    </message>
    <message>
        <source>there is no LED {led}; the pen has LEDs 1 to {n_leds}. Check that the LED file is of this pen, and that LEDs are numbered from 1.</source>
        <translation>没有 LED {led}；光笔有 LED 1 至 {n_leds}。请检查 LED 文件是否属于这支光笔，以及 LED 是否从 1 开始编号。</translation>
    </message>
    <message>
        <source>tip and U for Q-DAS (.dfq)</source>
        <translation>供 Q-DAS 使用的测球中心和 U (.dfq)</translation>
    </message>
    <message>
        <source>top front hole bore dome countersink pad</source>
        <translation>上面 前面 孔 内孔 球面 锥孔 凸台</translation>
    </message>
    <message>
        <source>x and y of the LED centres are exchanged</source>
        <translation>LED 中心的 x 与 y 互换</translation>
    </message>
    <message>
        <source>x, y, z in mm, separated by tabs</source>
        <translation>x、y、z，单位 mm，以制表符分隔</translation>
    </message>
    <message>
        <source>{address} is not an address of this computer. Give its address in the network of the clients, or {loopback} for this computer only.</source>
        <translation>{address} 不是本机的地址。请给出本机在客户端网络中的地址；仅限本机时用 {loopback}。</translation>
    </message>
    <message>
        <source>{cell} has separators of thousands; write it without them.</source>
        <translation>{cell} 含有千位分隔符；请去掉后书写。</translation>
    </message>
    <message>
        <source>{cell} is no number of an LED. Number the LEDs in the order of the LED file, from 1.</source>
        <translation>{cell} 不是 LED 编号。请按 LED 文件中的顺序从 1 开始给 LED 编号。</translation>
    </message>
    <message>
        <source>{cell} is no number or time of a frame: up to 19 digits, 9 of them behind the decimal point.</source>
        <translation>{cell} 不是帧的编号或时间：最多 19 位数字，其中小数点后 9 位。</translation>
    </message>
    <message>
        <source>{cell} is not a number; leave out what is not known or does not belong here.</source>
        <translation>{cell} 不是数字；未知或不属于此处的内容请删去。</translation>
    </message>
    <message>
        <source>{cell} is not a whole number. Put the names of the columns on top, or correct it.</source>
        <translation>{cell} 不是整数。请在首行写明各列名称，或更正该值。</translation>
    </message>
    <message>
        <source>{cell} is the name of no LED, which ends in its number here. Remove the line, or number the LED.</source>
        <translation>{cell} 不是 LED 的名称：此处的名称以编号结尾。请删除该行，或给 LED 编号。</translation>
    </message>
    <message>
        <source>{count}, run {run} of {n_runs}</source>
        <translation>{count}，第 {run} / {n_runs} 轮</translation>
    </message>
    <message>
        <source>{entry} in {name} is {number:g}; a whole number of 0 or more is needed. Correct it.</source>
        <translation>{name} 中的 {entry} 为 {number:g}；需要 0 或更大的整数。请更正。</translation>
    </message>
    <message>
        <source>{key} of {place} is no rotation, or a mirrored one: its rows must have the length 1, be at right angles to each other, and right-handed. Give the matrix row by row, or a unit quaternion w x y z.</source>
        <translation>{place}的 {key} 不是旋转或为镜像：各行的长度必须为 1、两两垂直且构成右手系。请逐行给出矩阵，或给出单位四元数 w x y z。</translation>
    </message>
    <message>
        <source>{kind} by {size:.3f} mm before image {image}. Images {begin} to {end} alone are the longer part.</source>
        <translation>{kind} {size:.3f} mm，发生在图像 {image} 之前。较长部分为图像 {begin} 至 {end}。</translation>
    </message>
    <message>
        <source>{kind}, {side}</source>
        <translation>{kind}，{side}</translation>
    </message>
    <message>
        <source>{n_duplicates} views repeat the board position of another view and do not count ({names}). {n_views} views remain. Move the board between views.</source>
        <translation>{n_duplicates} 个视图与其他视图的标定板位置重复，不计入（{names}）。剩余 {n_views} 个视图。请在视图之间移动标定板。</translation>
    </message>
    <message>
        <source>{n_leds} LEDs in {n_frames} frames of {name} are not seen: their centres are empty, NaN, (0, 0) or (-1, -1), or marked as not seen.</source>
        <translation>{name} 的 {n_frames} 帧中有 {n_leds} 个 LED 未检测到：其中心为空、NaN、(0, 0) 或 (-1, -1)，或标记为未检测到。</translation>
    </message>
    <message>
        <source>{n_left_out} of {n_poses} poses are outliers and were excluded: {poses}. Check the tracking for disturbances, and whether tip, cone or tracker moved.</source>
        <translation>{n_poses} 个位姿中有 {n_left_out} 个为离群值，已剔除：{poses}。请检查跟踪是否受到干扰，以及测头、锥孔或跟踪器是否移动过。</translation>
    </message>
    <message>
        <source>{n_lost} of {n_poses} poses are lost and left out.</source>
        <translation>{n_poses} 个位姿中有 {n_lost} 个丢失，未使用。</translation>
    </message>
    <message>
        <source>{n_points} of {needed} points</source>
        <translation>{n_points} / {needed} 点</translation>
    </message>
    <message>
        <source>{n_tagged} of {n_images} images, the first of them {name}, have the orientation tag {tag} ({meaning}). It is not applied: the pixels are used as stored, which must be the orientation that the intrinsics file was made for. If another program turned the images, save them again as the camera delivers them.</source>
        <translation>{n_images} 幅图像中有 {n_tagged} 幅（第一幅为 {name}）带有方向标记 {tag}（{meaning}）。程序不执行该标记：像素按存储的方向使用，内参文件必须是在这一方向上标定的。如果图像被其他程序旋转过，请按相机原样输出重新保存。</translation>
    </message>
    <message>
        <source>{n_views} images show the board; at least {least} are needed, {enough} are better. Add views with the board tilted by 20 to 40 degrees to each side, and in each corner of the image.</source>
        <translation>{n_views} 幅图像显示标定板；至少需要 {least} 幅，{enough} 幅更好。请增加标定板向各侧倾斜 20 至 40 度以及位于图像各角的视图。</translation>
    </message>
    <message>
        <source>{n_wrong} of {n_readable} images are {size}, the intrinsics file was made for {width} x {height} px. Choose the file for this camera, turn images back that another program turned by 90 degrees, or switch off binning and cropping.</source>
        <translation>{n_readable} 幅图像中有 {n_wrong} 幅为 {size}，而内参文件适用于 {width} × {height} px。请选择这台相机的文件，把被其他程序旋转了 90 度的图像转回，或关闭像素合并和裁剪。</translation>
    </message>
    <message>
        <source>{n_wrong} of {n_readable} images are {size}. The intrinsics file is for {width} x {height} px: it states binning or a region (binning_x, binning_y, roi) of {of_width} x {of_height} px. Correct these entries, or choose the file for this camera.</source>
        <translation>{n_readable} 幅图像中有 {n_wrong} 幅为 {size}。内参文件适用于 {width} × {height} px：该文件声明了 {of_width} × {of_height} px 图像的像素合并或区域（binning_x、binning_y、roi）。请更正这些条目，或选择这台相机的文件。</translation>
    </message>
    <message>
        <source>{name}</source>
        <translation>{name}</translation>
    </message>
    <message>
        <source>{name} begins with {start} and has no named values, as YAML, JSON, XML and TOML have them. Check that this is the right file, or write what it holds in one of these forms.</source>
        <translation>{name} 以 {start} 开头，没有 YAML、JSON、XML 和 TOML 那样的命名值。请检查文件是否正确，或将其内容写成这些格式之一。</translation>
    </message>
    <message>
        <source>{name} contains more than one YAML document. Keep one of them.</source>
        <translation>{name} 含有多个 YAML 文档。请只保留一个。</translation>
    </message>
    <message>
        <source>{name} contains the tables of another program and was not changed. Use a separate database for the archive.</source>
        <translation>{name} 中有其他程序的表，未作更改。请为档案库使用单独的数据库。</translation>
    </message>
    <message>
        <source>{name} describes {n_cameras} cameras. Keep the camera that observes the pen, and remove the others.</source>
        <translation>{name} 描述了 {n_cameras} 台相机。请保留观察光笔的那一台，删除其他相机。</translation>
    </message>
    <message>
        <source>{name} does not end in .csv or .json. Choose a name that does; LED files are written in these formats.</source>
        <translation>{name} 不以 .csv 或 .json 结尾；LED 文件以这两种格式保存。请另选名称。</translation>
    </message>
    <message>
        <source>{name} does not end in .yaml; intrinsics files are written as YAML. Choose a name that ends in .yaml.</source>
        <translation>{name} 不以 .yaml 结尾；内参文件以 YAML 保存。请选择以 .yaml 结尾的名称。</translation>
    </message>
    <message>
        <source>{name} does not state the distortion. Add the line distortion_coefficients: [k1, k2, p1, p2, k3], with zeros if the images are free of distortion.</source>
        <translation>{name} 未给出畸变。请加入一行 distortion_coefficients: [k1, k2, p1, p2, k3]；若图像无畸变则填零。</translation>
    </message>
    <message>
        <source>{name} does not state the image size. Add the lines image_width and image_height, in pixels.</source>
        <translation>{name} 没有说明图像尺寸。请加上 image_width 和 image_height 两行，单位为像素。</translation>
    </message>
    <message>
        <source>{name} does not state the unit of its coordinates. State it in the header: led,x_mm,y_mm,z_mm.</source>
        <translation>{name} 未注明坐标单位。请在表头中注明：led,x_mm,y_mm,z_mm。</translation>
    </message>
    <message>
        <source>{name} has a column {column}: its whole numbers x and y seem to be the corners of boxes. Write the centres of LEDs, as columns cx,cy.</source>
        <translation>{name} 有 {column} 列：其整数 x 和 y 似乎是方框的角点。请写入 LED 的中心，列名为 cx,cy。</translation>
    </message>
    <message>
        <source>{name} has a header but no rows below it. Check that it is complete.</source>
        <translation>{name} 有表头，但下面没有数据行。请检查文件是否完整。</translation>
    </message>
    <message>
        <source>{name} has a transform of frame {frame} that is not 16 numbers. Record it again.</source>
        <translation>{name} 中帧 {frame} 的变换不是 16 个数值。请重新记录。</translation>
    </message>
    <message>
        <source>{name} has levels up to {top}: more than {bits} bits hold. State the bits of the camera&apos;s pixel format, or none.</source>
        <translation>{name} 的灰度值最高为 {top}，超出 {bits} 位所能表示的范围。请填写相机像素格式的位数，或不填写。</translation>
    </message>
    <message>
        <source>{name} has more than {most:,} values. Check that this is the right file.</source>
        <translation>{name} 的值超过 {most:,} 个。请检查文件是否正确。</translation>
    </message>
    <message>
        <source>{name} has more than {most} lines. Check that this is the right file, or split it.</source>
        <translation>{name} 超过 {most} 行。请检查文件是否正确，或将其拆分。</translation>
    </message>
    <message>
        <source>{name} has no columns of poses that are known. Its header is {header}. Name the columns qw,qx,qy,qz,tx_mm,ty_mm,tz_mm, or r11 to r33,tx_mm,ty_mm,tz_mm.</source>
        <translation>{name} 没有可识别的位姿列。其表头为 {header}。请将列命名为 qw,qx,qy,qz,tx_mm,ty_mm,tz_mm，或 r11 至 r33,tx_mm,ty_mm,tz_mm。</translation>
    </message>
    <message>
        <source>{name} has no pose in any of its {n_poses} rows: the tool was not seen. Choose the right tool, or repeat the recording.</source>
        <translation>{name} 的 {n_poses} 行中都没有位姿：未检测到工具。请选择正确的工具，或重新记录。</translation>
    </message>
    <message>
        <source>{name} has no transforms that move (Seq_Frame0000_StylusToTrackerTransform). Record the sequence with the transforms of the tracker.</source>
        <translation>{name} 中没有变化的变换（Seq_Frame0000_StylusToTrackerTransform）。请连同跟踪器的变换一起记录序列。</translation>
    </message>
    <message>
        <source>{name} has no {entry}. Check that this is the right file and that it is complete.</source>
        <translation>{name} 没有 {entry}。请检查文件是否正确且完整。</translation>
    </message>
    <message>
        <source>{name} has only comments. Check that it is complete.</source>
        <translation>{name} 只有注释。请检查其是否完整。</translation>
    </message>
    <message>
        <source>{name} has rotations that are none: quaternions need the length 1, and the rows of matrices the length 1 at right angles. Export the poses again.</source>
        <translation>{name} 中的旋转无效：四元数的长度须为 1，矩阵各行的长度须为 1 且相互垂直。请重新导出位姿。</translation>
    </message>
    <message>
        <source>{name} has the calibration_temperature {celsius:g}; degrees Celsius from {coldest:g} to {warmest:g} are needed. Correct or remove it.</source>
        <translation>{name} 中 calibration_temperature 为 {celsius:g}；应为 {coldest:g} 至 {warmest:g} 摄氏度。请更正或删除。</translation>
    </message>
    <message>
        <source>{name} has the poses of {n_tools} tools: {tools}. State which one is the pen.</source>
        <translation>{name} 含有 {n_tools} 个工具的位姿：{tools}。请指明哪一个是笔。</translation>
    </message>
    <message>
        <source>{name} has the unit {unit}, which is not supported. Use one of {known}.</source>
        <translation>{name} 的单位 {unit} 不受支持。请使用 {known} 之一。</translation>
    </message>
    <message>
        <source>{name} has the unknown key {key}. Remove it, or correct it to one of {known}.</source>
        <translation>{name} 中有未知的键 {key}。请删除，或改为 {known} 之一。</translation>
    </message>
    <message>
        <source>{name} has the {what} {number:g}. Give a number above {least:g} and up to {most:g}, or omit it if unknown.</source>
        <translation>{name} 中的 {what} 为 {number:g}。需要大于 {least:g} 且不超过 {most:g} 的数；若未知请略去。</translation>
    </message>
    <message>
        <source>{name} has translations in {unit}, which is no known unit. Write them in mm, cm, m, um or inch.</source>
        <translation>{name} 的平移以 {unit} 为单位，无法识别。请以 mm、cm、m、um 或 inch 写出。</translation>
    </message>
    <message>
        <source>{name} has values of type {value_type}; grey values of 8 or 16 bit are needed. Save the images without conversion.</source>
        <translation>{name} 的数值类型为 {value_type}；需要 8 或 16 位灰度值。请不经转换保存图像。</translation>
    </message>
    <message>
        <source>{name} has {count} distortion coefficients with k4 of Metashape, a thin prism or a tilted sensor; 4, 5 or 8 are supported. Calibrate the camera again without these terms.</source>
        <translation>{name} 有 {count} 个畸变系数，含 Metashape 的 k4、薄棱镜或倾斜传感器项；支持 4、5 或 8 个。请不用这些项重新标定相机。</translation>
    </message>
    <message>
        <source>{name} has {count} parameters of the model {model}, which has {names}. Export the file again.</source>
        <translation>{name} 有模型 {model} 的 {count} 个参数，该模型的参数为 {names}。请重新导出文件。</translation>
    </message>
    <message>
        <source>{name} has {n_cells:,} cells; at most {most:,} are read. Check that this is the right file, or split it.</source>
        <translation>{name} 有 {n_cells:,} 个单元格；最多读取 {most:,} 个。请检查文件是否正确，或将其拆分。</translation>
    </message>
    <message>
        <source>{name} has {n_channels} channels a pixel; 1 (grey), 3 (colour) or 4 are needed. Save the channels as pages or as files of their own.</source>
        <translation>{name} 的每个像素有 {n_channels} 个通道；需要 1 个（灰度）、3 个（彩色）或 4 个。请把各通道分别保存为页或单独的文件。</translation>
    </message>
    <message>
        <source>{name} has {n_frames} frames; at most {most} are read. Check that this is the right file, or split it.</source>
        <translation>{name} 有 {n_frames} 帧；最多读取 {most} 帧。请检查文件是否正确，或将其拆分。</translation>
    </message>
    <message>
        <source>{name} has {width} x {height} px, {first} has {first_width} x {first_height} px. Give images of one camera, with one region and binning.</source>
        <translation>{name} 为 {width} x {height} px，{first} 为 {first_width} x {first_height} px。请提供同一相机、相同区域和像素合并设置的图像。</translation>
    </message>
    <message>
        <source>{name} is a TIFF with the compression {compression}, which is not supported. Save the images as PNG, or without compression.</source>
        <translation>{name} 是压缩方式为 {compression} 的 TIFF，不受支持。请将图像保存为 PNG 或不压缩。</translation>
    </message>
    <message>
        <source>{name} is a camera of {program} with the lens model {model}, which cannot be read. {remedy}</source>
        <translation>{name} 是 {program} 的相机，镜头模型为 {model}，无法读取。{remedy}</translation>
    </message>
    <message>
        <source>{name} is a file of the kind {program}, from which no LED centres are read. Write them as a table with the header frame,led,x_px,y_px and a line for each LED in each frame.</source>
        <translation>{name} 是 {program} 类型的文件，无法从中读取 LED 中心。请写成表格：表头为 frame,led,x_px,y_px，每幅图像中的每个 LED 一行。</translation>
    </message>
    <message>
        <source>{name} is a file of the kind {program}, whose markers cannot be read. Write them as a table: led,x_mm,y_mm,z_mm.</source>
        <translation>{name} 是 {program} 类文件，其标志点无法读取。请将其写成表格：led,x_mm,y_mm,z_mm。</translation>
    </message>
    <message>
        <source>{name} is a tool definition of NDI, whose coordinates cannot be read. Write the markers that 6D Architect shows as a table: led,x_mm,y_mm,z_mm.</source>
        <translation>{name} 是 NDI 的工具定义文件，其坐标无法读取。请将 6D Architect 显示的标志点写成表格：led,x_mm,y_mm,z_mm。</translation>
    </message>
    <message>
        <source>{name} is a workbook; to read it, python-calamine is needed, which is not installed. Save it as CSV.</source>
        <translation>{name} 是工作簿；读取它需要 python-calamine，但未安装。请另存为 CSV。</translation>
    </message>
    <message>
        <source>{name} is an intrinsics file of {program}, which cannot be read. {remedy}</source>
        <translation>{name} 是 {program} 的内参文件，无法读取。{remedy}</translation>
    </message>
    <message>
        <source>{name} is damaged or not a supported image (PNG, JPEG, BMP, TIFF, PGM, WebP). Capture or copy it again.</source>
        <translation>{name} 已损坏或不是支持的图像（PNG、JPEG、BMP、TIFF、PGM、WebP）。请重新采集或复制。</translation>
    </message>
    <message>
        <source>{name} is for images of {width} x {height} px, which have no region {roi} (x, y, width, height) binned {columns} x {lines}. Give the region in pixels of these images.</source>
        <translation>{name} 适用于 {width} x {height} px 的图像，其中没有按 {columns} x {lines} 合并的区域 {roi}（x、y、宽、高）。请以这些图像的像素给出区域。</translation>
    </message>
    <message>
        <source>{name} is nested more than {n_levels} levels deep. Check that this is the right file.</source>
        <translation>{name} 的嵌套超过 {n_levels} 层。请检查文件是否正确。</translation>
    </message>
    <message>
        <source>{name} is no rig file as it is read here, but of {program}. Write the intrinsics of each camera to its own file, and name these, the rotations and the translations in mm in a rig file: see Help, Rig files.</source>
        <translation>{name} 不是此处可读取的相机组文件，而是 {program} 的文件。请将每台相机的内参写入单独的文件，并在相机组文件中写明这些文件、旋转和以 mm 为单位的平移：见“帮助”中的“相机组文件”。</translation>
    </message>
    <message>
        <source>{name} is not a supported image (PNG, JPEG, BMP, TIFF, PGM, WebP). Save the images as PNG or TIFF, or copy it again.</source>
        <translation>{name} 不是支持的图像（PNG、JPEG、BMP、TIFF、PGM、WebP）。请将图像保存为 PNG 或 TIFF，或重新复制。</translation>
    </message>
    <message>
        <source>{name} is the raw image of a colour camera: its pixels repeat the pattern of a Bayer filter, which moves the centres of LEDs. Save the images in colour (demosaiced) or grey, or use a monochrome camera.</source>
        <translation>{name} 是彩色相机的原始图像：像素重复拜耳滤光片的图案，会使 LED 中心偏移。请保存为彩色图像（已去马赛克）或灰度图像，或使用黑白相机。</translation>
    </message>
    <message>
        <source>{name} is {width} x {height} px, the other images are {usual_width} x {usual_height} px. Replay only images of one camera together.</source>
        <translation>{name} 为 {width} × {height} px，其他图像为 {usual_width} × {usual_height} px。请只回放同一台相机的图像。</translation>
    </message>
    <message>
        <source>{name}: U (k = 2) is {uncertainty:.4f} mm, more than the limit of {limit:.4f} mm. Probe more points, and lay a length across the view.</source>
        <translation>{name}：U（k = 2）为 {uncertainty:.4f} mm，超过限值 {limit:.4f} mm。请触测更多点，并使长度横向于视线。</translation>
    </message>
    <message>
        <source>{name}: error {error:+.4f} mm (U {uncertainty:.4f} mm, limit {limit:.4f} mm). Check the certified value and the ball diameter. Otherwise the scale of the LED file or the intrinsics file is wrong, or the pen is warmer than at its measurement.</source>
        <translation>{name}：误差 {error:+.4f} mm（U {uncertainty:.4f} mm，限值 {limit:.4f} mm）。请检查证书值和测球直径。否则 LED 文件的比例或内参文件有误，或光笔比测量它时更热。</translation>
    </message>
    <message>
        <source>{name}: error {error:+.4f} mm at most (U {uncertainty:.4f} mm, limit {limit:.4f} mm). This verifies the scale, not the tip.</source>
        <translation>{name}：最大误差 {error:+.4f} mm（U {uncertainty:.4f} mm，限值 {limit:.4f} mm）。这验证比例，不验证测头。</translation>
    </message>
    <message>
        <source>{other} was calibrated with another LED file than {first}. Give calibrations of one pen with one LED file.</source>
        <translation>{other} 使用的 LED 文件与 {first} 不同。请给出同一支光笔、同一 LED 文件的标定。</translation>
    </message>
    <message>
        <source>{part}: all {n_judged} characteristics are within their tolerances.</source>
        <translation>{part}：全部 {n_judged} 个特性均在公差内。</translation>
    </message>
    <message>
        <source>{part}: not all features were probed ({names} missing).</source>
        <translation>{part}：并非所有要素都已触测（缺少 {names}）。</translation>
    </message>
    <message>
        <source>{part}: {n_features} features measured; the plan has no tolerances.</source>
        <translation>{part}：已测量 {n_features} 个要素；计划未规定公差。</translation>
    </message>
    <message>
        <source>{part}: {n_open} of {n_judged} characteristics are neither proven within nor out of tolerance ({names}).</source>
        <translation>{part}：{n_judged} 个特性中有 {n_open} 个既未证明合格也未证明超差（{names}）。</translation>
    </message>
    <message>
        <source>{part}: {n_out} of {n_judged} characteristics are out of tolerance ({names}).</source>
        <translation>{part}：{n_judged} 个特性中有 {n_out} 个超差（{names}）。</translation>
    </message>
    <message>
        <source>The address of the archive&apos;s server cannot be read. It has the form postgresql://user:password@host/database, with %40 for an @ in the password.</source>
        <translation>无法读取档案服务器的地址。其格式为 postgresql://user:password@host/database，口令中的 @ 写作 %40。</translation>
    </message>
    <message>
        <source>&apos;{id}&apos; is not a valid ID. Enter up to {most} letters and digits without / and \, as on the label.</source>
        <translation>&apos;{id}&apos; 不是有效的编号。请按标签输入不超过 {most} 个字母和数字，不含 / 和 \。</translation>
    </message>
    <message>
        <source>3D Slicer</source>
        <translation>3D Slicer</translation>
    </message>
    <message>
        <source>A swing with firm pressure is compared only and cannot be accepted.</source>
        <translation>用力按压的摆动仅供比较，不能接受。</translation>
    </message>
    <message>
        <source>Camera {camera} is not synchronised with the first camera (about {lag}). This shifts the tip and may cause other warnings. Trigger all cameras by one signal, or hold the pen still for each image.</source>
        <translation>相机 {camera} 与第一台相机不同步（约 {lag}）。这会使测头位置偏移，并可能引起其他警告。请用同一信号触发全部相机，或在每次取图时保持光笔静止。</translation>
    </message>
    <message>
        <source>The adjustment of pen and camera did not converge: the swing shows too little of them, LEDs move on the pen, or the zoom changed. Tilt the pen by 30 degrees in all directions, turn it about its axis, come closer to the camera, fasten the LEDs, and lock the zoom.</source>
        <translation>光笔与相机的平差未收敛：摆动提供的信息太少，LED 在光笔上移动，或变焦发生了变化。请将光笔向各个方向倾斜 30 度，绕其轴线转动，靠近相机，固定好 LED，并锁定变焦。</translation>
    </message>
    <message>
        <source>The swing is paused.</source>
        <translation>摆动已暂停。</translation>
    </message>
    <message>
        <source>The swing is too weak: U of the tip is {U:.2g} mm, the focal length is uncertain by {focal:.2g} %, and the pen&apos;s tilt varies by {tilt:.0f} degrees. Tilt the pen by 30 degrees in all directions, and turn it about its axis.</source>
        <translation>摆动不充分：测头 U 为 {U:.2g} mm，焦距不确定度为 {focal:.2g} %，光笔倾斜变化 {tilt:.0f} 度。请向各方向倾斜 30 度，并绕轴线转动光笔。</translation>
    </message>
    <message>
        <source>The tip rests in the cone. Keep it pressed in.</source>
        <translation>测头已在锥孔中。请保持压紧。</translation>
    </message>
    <message>
        <source>The probed points of {name} do not show its kind. Probe more points of it, or state its kind: {kinds}.</source>
        <translation>{name} 的测点无法确定其类型。请触测更多点，或指定类型：{kinds}。</translation>
    </message>
    <message>
        <source>The verification belongs to {result}, which is no longer current for tip {tip} of pen {pen}. Close the verification and start another one.</source>
        <translation>此验证属于 {result}，它已不是光笔 {pen} 测头 {tip} 的当前结果。请关闭此验证并重新开始。</translation>
    </message>
    <message>
        <source>The verification was started with another intrinsics file or LED file than the selected one. Select that file, then continue.</source>
        <translation>此验证开始时使用的内参文件或 LED 文件与当前所选不同。请选择该文件，然后继续。</translation>
    </message>
    <message>
        <source>The video {path} cannot be decoded within {most:.0f} MB. Save its frames as images.</source>
        <translation>视频 {path} 无法在 {most:.0f} MB 内存内解码。请将其各帧另存为图像。</translation>
    </message>
    <message>
        <source>The video {path} cannot be read: this installation has no FFmpeg and reads Motion JPEG in .avi files only. Save the video in this form, or save its frames as images.</source>
        <translation>无法读取视频 {path}：此安装不含 FFmpeg，只能读取 .avi 文件中的 Motion JPEG。请以该格式保存视频，或将其帧保存为图像。</translation>
    </message>
    <message>
        <source>The video {path} has more than {most} frames. Cut out the swing, or save its frames as images.</source>
        <translation>视频 {path} 超过 {most} 帧。请截取摆动部分，或将各帧另存为图像。</translation>
    </message>
    <message>
        <source>The views do not determine the camera: they are too similar. Add views with the board tilted by 20 to 40 degrees to each side, and reaching into each corner of the image.</source>
        <translation>这些视图无法确定相机：它们过于相似。请增加标定板向各侧倾斜 20 至 40 度并伸入图像各角的视图。</translation>
    </message>
    <message>
        <source>The {what} {path} does not exist. Check the name and the folder.</source>
        <translation>{what} {path} 不存在。请检查名称和文件夹。</translation>
    </message>
    <message>
        <source>The {what} {path} is empty. Check how it was saved or copied.</source>
        <translation>{what} {path} 是空的。请检查它是如何保存或复制的。</translation>
    </message>
    <message>
        <source>There is no folder, video or image at {place}. Check the name.</source>
        <translation>{place} 处没有文件夹、视频或图像。请检查名称。</translation>
    </message>
    <message>
        <source>U (k = 2) of the tip is {uncertainty:.4f} mm in its weakest direction.</source>
        <translation>测头在最弱方向上的 U (k = 2) 为 {uncertainty:.4f} mm。</translation>
    </message>
    <message>
        <source>a cell is empty where a number is needed.</source>
        <translation>需要数字的单元格为空。</translation>
    </message>
    <message>
        <source>ambiguous</source>
        <translation>有歧义</translation>
    </message>
    <message>
        <source>away from the camera</source>
        <translation>远离相机方向</translation>
    </message>
    <message>
        <source>away to the left</source>
        <translation>远离相机偏左</translation>
    </message>
    <message>
        <source>away to the right</source>
        <translation>远离相机偏右</translation>
    </message>
    <message>
        <source>blurred</source>
        <translation>图像模糊</translation>
    </message>
    <message>
        <source>intrinsics file</source>
        <translation>内参文件</translation>
    </message>
    <message>
        <source>cone</source>
        <translation>锥孔</translation>
    </message>
    <message>
        <source>distortion coefficient {name}</source>
        <translation>畸变系数 {name}</translation>
    </message>
    <message>
        <source>entry {number} of the station {station}</source>
        <translation>工位 {station} 的第 {number} 个条目</translation>
    </message>
    <message>
        <source>exposure</source>
        <translation>曝光</translation>
    </message>
    <message>
        <source>file of LED centres</source>
        <translation>LED 中心文件</translation>
    </message>
    <message>
        <source>focal length</source>
        <translation>焦距</translation>
    </message>
    <message>
        <source>folder</source>
        <translation>文件夹</translation>
    </message>
    <message>
        <source>gain</source>
        <translation>增益</translation>
    </message>
    <message>
        <source>image</source>
        <translation>图像</translation>
    </message>
    <message>
        <source>it is not a list of numbers.</source>
        <translation>不是数字列表。</translation>
    </message>
    <message>
        <source>journal</source>
        <translation>日志文件</translation>
    </message>
    <message>
        <source>leds in {name} is no list of LEDs. Write it as [{{&quot;led&quot;: 1, &quot;x&quot;: 0, &quot;y&quot;: 0, &quot;z&quot;: -30}}, ...].</source>
        <translation>{name} 中的 leds 不是 LED 列表。请写成 [{{&quot;led&quot;: 1, &quot;x&quot;: 0, &quot;y&quot;: 0, &quot;z&quot;: -30}}, ...]。</translation>
    </message>
    <message>
        <source>no LED seen</source>
        <translation>看不到 LED</translation>
    </message>
    <message>
        <source>pen</source>
        <translation>光笔</translation>
    </message>
    <message>
        <source>pose file</source>
        <translation>位姿文件</translation>
    </message>
    <message>
        <source>poses</source>
        <translation>位姿</translation>
    </message>
    <message>
        <source>principal point cx</source>
        <translation>主点 cx</translation>
    </message>
    <message>
        <source>principal point cy</source>
        <translation>主点 cy</translation>
    </message>
    <message>
        <source>r11 to r33 are a mirrored rotation (determinant -1). Give the poses in right-handed frames.</source>
        <translation>r11 至 r33 是镜像旋转（行列式为 -1）。请用右手坐标系给出位姿。</translation>
    </message>
    <message>
        <source>r11 to r33 are not a rotation: their rows must have the length 1 and be at right angles to each other. Check the order of the columns.</source>
        <translation>r11 至 r33 不是旋转矩阵：各行长度必须为 1 且相互垂直。请检查列的顺序。</translation>
    </message>
    <message>
        <source>ratio fy / fx of the focal lengths</source>
        <translation>焦距之比 fy / fx</translation>
    </message>
    <message>
        <source>record&apos;s header</source>
        <translation>记录头文件</translation>
    </message>
    <message>
        <source>result</source>
        <translation>结果</translation>
    </message>
    <message>
        <source>settings file</source>
        <translation>设置文件</translation>
    </message>
    <message>
        <source>source of images</source>
        <translation>图像来源</translation>
    </message>
    <message>
        <source>the intrinsics file. Calibrate the camera, and state the covariance in its file</source>
        <translation>内参文件。请标定相机，并在文件中给出协方差</translation>
    </message>
    <message>
        <source>the direction ({x:.2f}, {y:.2f}, {z:.2f}) of the pen</source>
        <translation>光笔的方向 ({x:.2f}, {y:.2f}, {z:.2f})</translation>
    </message>
    <message>
        <source>Certified size / mm</source>
        <translation>证书尺寸 / mm</translation>
    </message>
    <message>
        <source>The points of {run} are at more than two positions: point {number} is {distance:.2f} mm from the others of its end. Was the pen lifted there? Probe only the two ends.</source>
        <translation>{run} 的测点位于两个以上的位置：测点 {number} 距其所在端的其他测点 {distance:.2f} mm。光笔是否在那里被抬起？请只触测两端。</translation>
    </message>
    <message>
        <source>plate (flatness)</source>
        <translation>平板（平面度）</translation>
    </message>
    <message>
        <source>ring (radius)</source>
        <translation>圆环（半径）</translation>
    </message>
    <message>
        <source>sphere (diameter)</source>
        <translation>球（直径）</translation>
    </message>
    <message>
        <source>the images are mirrored top to bottom (in LED centres, y counts upwards)</source>
        <translation>图像上下镜像（对于 LED 中心：y 向上计数）</translation>
    </message>
    <message>
        <source>the lens, beyond its distortion model, and the systematic error of the LED centres. Calibrate the camera with views that fill the image, so that its file states the lens field, focus the lens, and illuminate the LEDs evenly</source>
        <translation>镜头超出畸变模型的部分以及 LED 中心的系统误差。请以布满图像的视图标定相机，使其文件给出镜头残余场；对焦镜头，并使 LED 发光均匀</translation>
    </message>
    <message>
        <source>the pen&apos;s {axis} axis</source>
        <translation>光笔的 {axis} 轴</translation>
    </message>
    <message>
        <source>the translation is more than {most:g} m. Check its units: millimetres are needed.</source>
        <translation>平移超过 {most:g} m。请检查单位：需要毫米。</translation>
    </message>
    <message>
        <source>the whole record of the calibration</source>
        <translation>完整的标定记录</translation>
    </message>
    <message>
        <source>the {what} is {value:g} where the first LED has {first:g}. It must be the same for all LEDs of a pen.</source>
        <translation>{what} 为 {value:g}，而第一个 LED 为 {first:g}。同一光笔的所有 LED 必须相同。</translation>
    </message>
    <message>
        <source>tip</source>
        <translation>测头</translation>
    </message>
    <message>
        <source>tip slipped</source>
        <translation>测头滑动</translation>
    </message>
    <message>
        <source>to most sides</source>
        <translation>向多数方向</translation>
    </message>
    <message>
        <source>to the left</source>
        <translation>向左</translation>
    </message>
    <message>
        <source>to the right</source>
        <translation>向右</translation>
    </message>
    <message>
        <source>too few LEDs</source>
        <translation>LED 太少</translation>
    </message>
    <message>
        <source>towards the camera</source>
        <translation>朝向相机方向</translation>
    </message>
    <message>
        <source>towards the camera to the left</source>
        <translation>朝向相机偏左</translation>
    </message>
    <message>
        <source>towards the camera to the right</source>
        <translation>朝向相机偏右</translation>
    </message>
    <message>
        <source>translation of cam_from_rig along {axis}</source>
        <translation>cam_from_rig 沿 {axis} 轴的平移</translation>
    </message>
    <message>
        <source>unreadable</source>
        <translation>无法读取</translation>
    </message>
    <message>
        <source>wrong size</source>
        <translation>尺寸不符</translation>
    </message>
    <message>
        <source>{cell} is not a finite number.</source>
        <translation>{cell} 不是有限数。</translation>
    </message>
    <message>
        <source>{count} columns</source>
        <translation>{count} 列</translation>
    </message>
    <message>
        <source>{count} distortion coefficients</source>
        <translation>{count} 个畸变系数</translation>
    </message>
    <message>
        <source>{count} numbers</source>
        <translation>{count} 个数</translation>
    </message>
    <message>
        <source>{entry} in {name} cannot be read: {flaw} Correct it, or export the file again.</source>
        <translation>{name} 中的 {entry} 无法读取：{flaw}请改正，或重新导出文件。</translation>
    </message>
    <message>
        <source>{entry} in {name} has no named values below it. The file may be cut short: copy or export it again.</source>
        <translation>{name} 中的 {entry} 下面没有命名的值。文件可能不完整：请重新复制或导出。</translation>
    </message>
    <message>
        <source>{entry} in {name} has {counted} where its {rows:g} rows of {cols:g} need {needed:g}. The file may be cut short: copy or export it again.</source>
        <translation>{name} 中的 {entry} 有 {counted}，而 {rows:g} 行 {cols:g} 列需要 {needed:g} 个。文件可能不完整：请重新复制或导出。</translation>
    </message>
    <message>
        <source>{entry} in {name} has {counted} where {needed} are needed. Correct it, or export the file again.</source>
        <translation>{name} 中的 {entry} 有 {counted}，需要 {needed} 个。请改正，或重新导出文件。</translation>
    </message>
    <message>
        <source>{entry} in {name} has {counted}; at most {most} are read. Correct it, or export the file again.</source>
        <translation>{name} 中的 {entry} 有 {counted}；最多读取 {most} 个。请更正，或重新导出文件。</translation>
    </message>
    <message>
        <source>{entry} in {name} must hold {needed} numbers, none of them negative: of fx fy cx cy and the {n_coefficients} distortion coefficients. Correct or remove it.</source>
        <translation>{name} 中的 {entry} 必须含 {needed} 个非负数：fx fy cx cy 以及 {n_coefficients} 个畸变系数。请改正或删除。</translation>
    </message>
    <message>
        <source>{key} is given a second time in {name}. Keep the right one.</source>
        <translation>{name} 中重复给出 {key}。请保留正确的一个。</translation>
    </message>
    <message>
        <source>{key} is given a second time on line {line} in {name}. Keep the right one.</source>
        <translation>{name} 第 {line} 行重复给出 {key}。请保留正确的一个。</translation>
    </message>
    <message>
        <source>{key} of {place} is more than {most:g} m. Check its units: millimetres are needed.</source>
        <translation>{place}的 {key} 超过 {most:g} m。请检查其单位：此处需要毫米。</translation>
    </message>
    <message>
        <source>{n_images} {reason}</source>
        <translation>{reason} {n_images} 幅</translation>
    </message>
    <message>
        <source>{n_named} of {n_views} views ({names}) differ from the others by {px:.2f} px over the image (fx {fx:+.2f}, cx {cx:+.2f}, cy {cy:+.2f} px), more than by chance. Check whether zoom, focus or mount changed.</source>
        <translation>{n_views} 个视图中有 {n_named} 个（{names}）与其余视图在整幅图像上相差 {px:.2f} px（fx {fx:+.2f}、cx {cx:+.2f}、cy {cy:+.2f} px），超出偶然范围。请检查变焦、对焦或安装是否改变。</translation>
    </message>
    <message>
        <source>{n_others} lights move together, but not with the pen: there is a second pen, or a mirror, or the zoom changed. Remove or cover it, lock the zoom, and repeat the swing.</source>
        <translation>有 {n_others} 个光点一起移动，但不随光笔移动：可能有第二支光笔或反射镜，或者变焦已改变。请将其移走或遮住，锁定变焦，然后重新摆动。</translation>
    </message>
    <message>
        <source>{n_poses} poses are usable; the tip needs at least {needed}. Capture more images.</source>
        <translation>可用位姿 {n_poses} 个；求测头至少需要 {needed} 个。请采集更多图像。</translation>
    </message>
    <message>
        <source>{n_poses} poses are usable; the two-stage method starts from {needed}. Capture more images.</source>
        <translation>可用位姿 {n_poses} 个；两步法至少需要 {needed} 个。请采集更多图像。</translation>
    </message>
    <message>
        <source>{n_usable} of {n_images} images are usable</source>
        <translation>{n_images} 幅图像中有 {n_usable} 幅可用</translation>
    </message>
    <message>
        <source>{name} cannot be decoded.</source>
        <translation>{name} 无法解码。</translation>
    </message>
    <message>
        <source>{name} cannot be decoded: {problem}.</source>
        <translation>{name} 无法解码：{problem}。</translation>
    </message>
    <message>
        <source>{name} describes a camera of the model {model}; the model pinhole is needed. Calibrate the camera again with pinhole-radtan.</source>
        <translation>{name} 描述的相机模型为 {model}；需要 pinhole 模型。请用 pinhole-radtan 重新标定相机。</translation>
    </message>
    <message>
        <source>{name} gives an image size of {width:g} x {height:g} px. Two whole numbers from 1 to {most} are needed.</source>
        <translation>{name} 给出的图像尺寸为 {width:g} × {height:g} px。需要两个 1 到 {most} 的整数。</translation>
    </message>
    <message>
        <source>{name} has LED discs {diameter:g} mm wide. A diameter of up to {most:g} mm is needed; check its units.</source>
        <translation>{name} 的 LED 发光面直径为 {diameter:g} mm。直径不得超过 {most:g} mm；请检查单位。</translation>
    </message>
    <message>
        <source>{name} has a skew of {skew:g} px; cameras without skew are needed. Calibrate the camera again without estimating a skew.</source>
        <translation>{name} 的倾斜系数为 {skew:g} px；需要无倾斜的相机。请不估计倾斜系数，重新标定相机。</translation>
    </message>
    <message>
        <source>{name} has coordinates in {one} and in {other}. Give all of them in one unit.</source>
        <translation>{name} 的坐标既有 {one} 又有 {other}。请全部使用同一单位。</translation>
    </message>
    <message>
        <source>{name} has its principal point at ({cx:g}, {cy:g}) px, far outside the image of {width} x {height} px. Check that both belong to the same camera and image size.</source>
        <translation>{name} 的主点位于 ({cx:g}, {cy:g}) px，远在 {width} × {height} px 的图像之外。请检查两者是否属于同一台相机和同一图像尺寸。</translation>
    </message>
    <message>
        <source>{name} has no column {column}; {what} need the columns {wanted}, with a line for each. Its header is {header}. Rename the columns, or arrange the table so.</source>
        <translation>{name} 没有列 {column}；{what}需要列 {wanted}，每项一行。其表头为 {header}。请重命名各列，或按此整理表格。</translation>
    </message>
    <message>
        <source>{name} has no header and {n_columns} columns. Poses have 7 (quaternion and translation), 12 or 16 (matrix), with a number or time before them. Put a header line on top: qw,qx,qy,qz,tx_mm,ty_mm,tz_mm, or r11 to r33,tx_mm,ty_mm,tz_mm.</source>
        <translation>{name} 没有表头，有 {n_columns} 列。位姿有 7 列（四元数和平移）、12 或 16 列（矩阵），前面可有编号或时间。请在首行写表头：qw,qx,qy,qz,tx_mm,ty_mm,tz_mm，或 r11 至 r33,tx_mm,ty_mm,tz_mm。</translation>
    </message>
    <message>
        <source>{name} has no header and {n_columns}; {what} need the {n_needed} columns {wanted}. Put a header line with these names on top, and separate the columns by commas, semicolons or tabs.</source>
        <translation>{name} 没有表头，有 {n_columns}；{what}需要 {n_needed} 列 {wanted}。请在最上面加一行含这些名称的表头，并用逗号、分号或制表符分隔各列。</translation>
    </message>
    <message>
        <source>{name} has no rows. Check that it is complete.</source>
        <translation>{name} 没有数据行。请检查文件是否完整。</translation>
    </message>
    <message>
        <source>{name} has the entries {found}, and no camera_matrix. An intrinsics file has image_width, image_height, camera_matrix and distortion_coefficients: check that this is the right file, or write these four.</source>
        <translation>{name} 含有条目 {found}，但没有 camera_matrix。内参文件应含 image_width、image_height、camera_matrix 和 distortion_coefficients：请检查文件是否正确，或写入这四项。</translation>
    </message>
    <message>
        <source>{name} has the focal lengths {fx:g} and {fy:g} px along u and v; with the pixels of a camera these are nearly alike. Export the file again, or calibrate the camera again.</source>
        <translation>{name} 沿 u 和 v 的焦距为 {fx:g} 和 {fy:g} px；相机的这两个值应几乎相同。请重新导出文件，或重新标定相机。</translation>
    </message>
    <message>
        <source>{name} has the focal lengths {fx:g} and {fy:g} px, too short for images of {width} x {height} px; they may be in millimetres. Give them in pixels.</source>
        <translation>{name} 的焦距为 {fx:g} 和 {fy:g} px，对 {width} × {height} px 的图像来说太短；可能以毫米为单位。请以像素给出。</translation>
    </message>
    <message>
        <source>{name} has the focal lengths {fx:g} and {fy:g} px; both must be positive. Export the file again, or calibrate the camera again.</source>
        <translation>{name} 的焦距为 {fx:g} 和 {fy:g} px；两者都必须为正。请重新导出文件，或重新标定相机。</translation>
    </message>
    <message>
        <source>{name} has the form of {program}, in which poses cannot be read. Write them as a table with the header qw,qx,qy,qz,tx_mm,ty_mm,tz_mm and a line for each pose.</source>
        <translation>{name} 是 {program} 的格式，无法从中读取位姿。请写成表格：表头为 qw,qx,qy,qz,tx_mm,ty_mm,tz_mm，每个位姿一行。</translation>
    </message>
    <message>
        <source>{name} has {counted}; 4, 5 or 8 are needed (k1 k2 p1 p2 k3 k4 k5 k6). Export the file again.</source>
        <translation>{name} 有 {counted}；需要 4、5 或 8 个 (k1 k2 p1 p2 k3 k4 k5 k6)。请重新导出文件。</translation>
    </message>
    <message>
        <source>{name} has {first} and {second}, which mean the same. Keep the right one.</source>
        <translation>{name} 中有含义相同的 {first} 和 {second}。请保留正确的一个。</translation>
    </message>
    <message>
        <source>{name} is a JPEG of {n_scans} scans; at most {most} are read. Save the images as PNG.</source>
        <translation>{name} 是含 {n_scans} 次扫描的 JPEG；最多读取 {most} 次。请将图像保存为 PNG。</translation>
    </message>
    <message>
        <source>{name} is a file of the kind {kind}, from which no images are read. Save its images as files of PNG or TIFF in one folder.</source>
        <translation>{name} 是 {kind} 类型的文件，无法从中读取图像。请将其中的图像另存为同一文件夹中的 PNG 或 TIFF 文件。</translation>
    </message>
    <message>
        <source>{name} is an animation. Save its images one by one.</source>
        <translation>{name} 是动画。请将其中的图像逐幅保存。</translation>
    </message>
    <message>
        <source>{name} is cut off. Capture or copy it again.</source>
        <translation>{name} 不完整。请重新拍摄或复制。</translation>
    </message>
    <message>
        <source>{name} is damaged (wrong checksum). Capture or copy it again.</source>
        <translation>{name} 已损坏（校验和错误）。请重新拍摄或复制。</translation>
    </message>
    <message>
        <source>A name, the camera images or a file is missing. Complete the earlier steps, then continue the verification.</source>
        <translation>缺少名称、相机图像或文件。请完成前面的步骤，然后继续验证。</translation>
    </message>
    <message>
        <source>A point {distance:.1f} mm from the others does not count: the tip was not in the cone. Put it into the cone and hold it still.</source>
        <translation>与其他各点相距 {distance:.1f} mm 的测点不计入：测头不在锥孔中。请把测头放入锥孔并保持不动。</translation>
    </message>
    <message>
        <source>A result with U within the limit is CHECK if the tips from odd and even images differ by more than the limit and by more than {halves:g} times U (k = 2) of their difference, if the images contradict a file by more than {contradicted:g} standard deviations, if cone and camera moved by more than {moved:.4f} mm, if the noise of LED centres exceeds {sigma:g} px, if an LED is displaced by more than {displaced:g} mm, if the cameras are not synchronised, if more than {dropped:.0f} % of the images with the pen are excluded, if fewer than {n_images} images show the pen, or none on one of the eight sides.</source>
        <translation>即使 U 合格，出现下列任一情形仍判为“需检查”：由奇数图像与偶数图像求得的测头之差既超过限值，又超过该差值 U (k = 2) 的 {halves:g} 倍；图像与文件的矛盾超过 {contradicted:g} 倍标准差；锥孔与相机的相对移动超过 {moved:.4f} mm；LED 中心的噪声超过 {sigma:g} px；某个 LED 明显偏离且超过 {displaced:g} mm；多台相机中有一台不同步；拍到光笔的图像中未参与计算的超过 {dropped:.0f} %；拍到光笔的图像少于 {n_images} 幅；八个方向中有一个方向没有图像。</translation>
    </message>
    <message>
        <source>A supervisor&apos;s approval and a reason are needed. Enter the supervisor&apos;s name and password.</source>
        <translation>需要主管批准和理由。请输入主管的姓名和密码。</translation>
    </message>
    <message>
        <source>All points of {run} lie within {extent:.3f} mm: one end was probed again and the other not at all. Probe both ends.</source>
        <translation>{run} 的全部测点都在 {extent:.3f} mm 之内：同一端被重复触测，另一端没有触测。请触测两端。</translation>
    </message>
    <message>
        <source>An internal error occurred, and the verification is paused. Results so far are kept; continue, or start over.</source>
        <translation>发生内部错误，验证已暂停。目前的结果已保留；请继续，或重新开始。</translation>
    </message>
    <message>
        <source>An internal error occurred. The captured images are saved. Continue, or restart the program.</source>
        <translation>发生内部错误。已采集的图像已保存。请继续，或重新启动程序。</translation>
    </message>
    <message>
        <source>An internal error occurred; image processing stopped. Open the camera again.</source>
        <translation>发生内部错误，图像处理已停止。请重新打开相机。</translation>
    </message>
    <message>
        <source>Another program changed the swing in {folder} after it was loaded. Load it again to continue with all images.</source>
        <translation>另一程序在载入后更改了 {folder} 中的摆动。请重新载入，以便用全部图像继续。</translation>
    </message>
    <message>
        <source>Another program is writing to the swing in {folder}. Continue there, or close that program and try again.</source>
        <translation>另一个程序正在写入 {folder} 中的摆动。请在那里继续，或关闭该程序后重试。</translation>
    </message>
    <message>
        <source>Another verification is not finished. Finish it or start over, then continue the interrupted one.</source>
        <translation>另一验证尚未完成。请先完成它或重新开始，然后继续中断的验证。</translation>
    </message>
    <message>
        <source>Ball diameter {diameter:g} mm is not valid; the range is above 0 to {most:g} mm. Enter the measured diameter, or leave it empty.</source>
        <translation>测球直径 {diameter:g} mm 无效；范围为大于 0 至 {most:g} mm。请输入测得的直径，或留空。</translation>
    </message>
    <message>
        <source>Both cameras see the board in {n_pairs} views; at least {least} are needed. Add views in which both cameras see the whole board.</source>
        <translation>两台相机同时看到标定板的视图有 {n_pairs} 组，至少需要 {least} 组。请补充两台相机都能看到整块板的视图。</translation>
    </message>
    <message>
        <source>Camera {camera} and another camera see the pen together at {n_pairs} of {n_moments} instants; {needed} are needed for the extrinsics. Give simultaneous images the same name, and point all cameras at the pen.</source>
        <translation>相机 {camera} 与另一台相机同时看到光笔的时刻有 {n_pairs} / {n_moments} 个；确定外参需要 {needed} 个。请让同一时刻的图像同名，并使每台相机都能看到光笔。</translation>
    </message>
    <message>
        <source>Camera {camera} has no image at {n_absent} of {n_moments} instants, such as {example}. The images of the other cameras are used there.</source>
        <translation>相机 {camera} 在 {n_moments} 个时刻中的 {n_absent} 个没有图像，例如 {example}。这些时刻采用其他相机的图像。</translation>
    </message>
    <message>
        <source>Camera {camera} shows another posture of the pen than the other cameras at {n_apart} of {n_moments} instants, such as {example}; these images are excluded. Check that simultaneous images have the same name, and check the trigger.</source>
        <translation>相机 {camera} 在 {n_moments} 个时刻中的 {n_apart} 个所示光笔姿态与其他相机不同，例如 {example}；这些图像已剔除。请检查同一时刻的图像是否同名，并检查触发信号。</translation>
    </message>
    <message>
        <source>Camera {camera} shows another rotation of the pen than the other cameras at {n_apart} of {n_pairs} instants. Check that the images belong to the same swing and are paired correctly, that one signal triggers all cameras, and that no camera moved.</source>
        <translation>相机 {camera} 所见光笔的转角与其他相机不一致（{n_pairs} 个时刻中的 {n_apart} 个）。请检查图像是否属于同一次摆动且配对正确、所有相机是否由同一信号触发，以及是否有相机移动。</translation>
    </message>
    <message>
        <source>Camera {serial} did not stop within {waited:.0f} s. Unplug it and restart the program.</source>
        <translation>相机 {serial} 在 {waited:.0f} s 内没有停止。请拔下相机，重新启动程序后再使用。</translation>
    </message>
    <message>
        <source>Camera {serial} no longer responds ({why}). Check cable and power.</source>
        <translation>相机 {serial} 不再响应（{why}）。请检查线缆和电源。</translation>
    </message>
    <message>
        <source>Camera {serial} rejects a setting: {why}. Choose another value.</source>
        <translation>相机 {serial} 拒绝一项设置：{why}。请另选。</translation>
    </message>
    <message>
        <source>Characteristics: lengths / mm, angles / degrees</source>
        <translation>特性：长度 / mm，角度 / 度</translation>
    </message>
    <message>
        <source>Computing the tip. Keep the pen at hand.</source>
        <translation>正在计算测头。请勿收起光笔。</translation>
    </message>
    <message>
        <source>Cone and camera moved by {distance:.3f} mm relative to each other during the swing. The result is corrected as far as possible, but probed points would be affected too. Clamp both and let the camera warm up.</source>
        <translation>摆动过程中锥孔与相机相对移动 {distance:.3f} mm。结果已尽可能修正，但测点同样会受影响。请固定两者，并让相机充分预热。</translation>
    </message>
    <message>
        <source>Decision rule of verifications</source>
        <translation>验证的判定规则</translation>
    </message>
    <message>
        <source>Decision rule: {rule}, at most {risk:g} %.</source>
        <translation>判定规则：{rule}，不超过 {risk:g} %。</translation>
    </message>
    <message>
        <source>Decision rule: {rule}.</source>
        <translation>判定规则：{rule}。</translation>
    </message>
    <message>
        <source>Different poses of the board: {n_views}; at least {least} are needed, 15 are better. Move and tilt the board between views.</source>
        <translation>标定板的不同位姿：{n_views} 个；至少需要 {least} 个，最好 15 个。请在各视图之间移动并倾斜标定板。</translation>
    </message>
    <message>
        <source>Entries {first} to {last} of chain {chain} are missing.</source>
        <translation>链 {chain} 的第 {first} 至第 {last} 个条目缺失。</translation>
    </message>
    <message>
        <source>Entry {number} of chain {chain} does not match its predecessor: one of the two was replaced.</source>
        <translation>链 {chain} 的第 {number} 个条目与前一条不衔接：两者之一被替换。</translation>
    </message>
    <message>
        <source>Entry {number} of chain {chain} introduces a station key that neither the key before nor a supervisor approved. Ask the station whether its data folder was moved to another computer.</source>
        <translation>链 {chain} 的第 {number} 条记录引入了一个工位密钥，既未经之前的密钥也未经主管批准。请询问该工位其数据文件夹是否被移到另一台计算机。</translation>
    </message>
    <message>
        <source>Entry {number} of chain {chain} is missing.</source>
        <translation>链 {chain} 的第 {number} 个条目缺失。</translation>
    </message>
    <message>
        <source>Entry {number} of chain {chain} is not the same here and on the server: a data folder was copied and both copies were used, or one side was modified. Nothing was copied. Check both sides, and keep them until the cause is known.</source>
        <translation>链 {chain} 的第 {number} 条记录在此处与服务器上不同：数据文件夹被复制且两份副本都被使用，或有一方被修改。未复制任何内容。请检查双方，并在查明原因之前予以保留。</translation>
    </message>
    <message>
        <source>Entry {number} of chain {chain} is signed by a key that is not the station&apos;s: it was forged, or entered by a copy of the data folder on another computer.</source>
        <translation>链 {chain} 的第 {number} 条记录不是用本工位的密钥签名的：它是伪造的，或由另一台计算机上的数据文件夹副本登记。</translation>
    </message>
    <message>
        <source>Entry {number} of chain {chain} was modified.</source>
        <translation>链 {chain} 的第 {number} 个条目被更改。</translation>
    </message>
    <message>
        <source>Feature {name}: {said}</source>
        <translation>要素 {name}：{said}</translation>
    </message>
    <message>
        <source>Features in the camera frame / mm, angles / degrees, k = 2</source>
        <translation>相机坐标系中的要素 / mm，角度 / 度，k = 2</translation>
    </message>
    <message>
        <source>Features in the part frame / mm, angles / degrees, k = 2</source>
        <translation>工件坐标系中的要素 / mm，角度 / 度，k = 2</translation>
    </message>
    <message>
        <source>Frame rate {sent:.1f} fps instead of {wanted:.1f} fps, limited by link or exposure. Lower the frame rate, or use a smaller region or a shorter exposure.</source>
        <translation>帧率为 {sent:.1f} 幅/秒，而不是设定的 {wanted:.1f} 幅/秒，受链路或曝光限制。请降低帧率，或使用更小的区域或更短的曝光。</translation>
    </message>
    <message>
        <source>Has the camera moved? Probe the cone {needed} times with the pen upright, and lift the tip in between: {n_touches} of {needed}. Visit {visit} of {n_visits}.</source>
        <translation>相机是否移动？请使光笔竖直，触测锥孔 {needed} 次，每次之间抬起测头：{n_touches} / {needed}。第 {visit} / {n_visits} 次触测漂移参考点。</translation>
    </message>
    <message>
        <source>Hold the pen of this tip in view of the camera.</source>
        <translation>请让相机看到该测头所属的光笔。</translation>
    </message>
    <message>
        <source>Hold the pen upright. Images needed: {n_images}.</source>
        <translation>请竖直握持光笔。还需 {n_images} 幅图像。</translation>
    </message>
    <message>
        <source>ITK transform</source>
        <translation>ITK 变换</translation>
    </message>
    <message>
        <source>If the tip has its own limit of change, the distance from the previous tip (as found) to the accepted tip (as left) is compared with it by simple acceptance; beyond it the verdict is CHECK.</source>
        <translation>若测头设有变化限值，则将前一测头（标定前状态）与所接受测头（标定后状态）之间的距离按简单接受与之比较；超出则判为“需检查”。</translation>
    </message>
    <message>
        <source>Image {seq} of camera {serial} was incomplete and was discarded. Check cable and network.</source>
        <translation>相机 {serial} 的图像 {seq} 不完整，已舍弃。请检查线缆和网络。</translation>
    </message>
    <message>
        <source>Images captured: {n_kept} of {needed} (minimum).</source>
        <translation>已采集图像：{n_kept} / {needed}（最少）。</translation>
    </message>
    <message>
        <source>Images in the pixel format {wanted} are not supported; the camera offers {offered}. Choose a format from Mono8 to Mono16.</source>
        <translation>不支持像素格式 {wanted} 的图像；相机提供 {offered}。请选择 Mono8 至 Mono16 的格式。</translation>
    </message>
    <message>
        <source>Images of {place} are no longer readable. Connect the disk, restore the images, or choose others.</source>
        <translation>{place} 的图像已无法读取。请连接磁盘或放回图像，或选择其他图像。</translation>
    </message>
    <message>
        <source>Images rejected: {n_dropped}. Press the tip into the cone again.</source>
        <translation>已舍去 {n_dropped} 幅图像。请将测头重新压入锥孔。</translation>
    </message>
    <message>
        <source>LED disc diameter {diameter:g} mm is not valid. Give a diameter of up to {most:g} mm.</source>
        <translation>LED 发光面直径不可能是 {diameter:g} mm。请给出不超过 {most:g} mm 的直径。</translation>
    </message>
    <message>
        <source>LED file</source>
        <translation>LED 文件</translation>
    </message>
    <message>
        <source>LED {led} is {distance:.2f} mm from its file position. Check that the LED file belongs to this pen.</source>
        <translation>LED {led} 与文件中的位置相差 {distance:.2f} mm。请检查 LED 文件是否属于此光笔。</translation>
    </message>
    <message>
        <source>LED {led} is {distance:.3f} mm from its file position. Check the LED file, or measure the pen again.</source>
        <translation>LED {led} 与文件中的位置相差 {distance:.3f} mm。请检查 LED 文件，或重新测量光笔。</translation>
    </message>
    <message>
        <source>LED {led} is {distance:.6g} m from the origin, which is implausible for a pen. Check the numbers and their units.</source>
        <translation>LED {led} 距原点 {distance:.6g} m，对光笔而言不合理。请检查数值及其单位。</translation>
    </message>
    <message>
        <source>LED {led} moved by {distance:.3f} mm relative to the others according to {swing}: it was knocked or is loose.</source>
        <translation>据 {swing}，LED {led} 相对其他 LED 移动了 {distance:.3f} mm：它被碰弯、碰撞或松动。</translation>
    </message>
    <message>
        <source>LED {led} was not detected in any image. It is covered, off, or its position in the LED file is wrong.</source>
        <translation>在所有图像中均未检测到 LED {led}。可能被遮住、未点亮，或 LED 文件中的位置有误。</translation>
    </message>
    <message>
        <source>LEDs detected: {seen}, needed: {needed}. Uncover the LEDs, or tilt back slightly.</source>
        <translation>检测到的 LED：{seen}，需要：{needed}。请勿遮挡 LED，或稍微往回倾斜。</translation>
    </message>
    <message>
        <source>LEDs of a pen</source>
        <translation>光笔的 LED</translation>
    </message>
    <message>
        <source>LEDs too small</source>
        <translation>LED 过小</translation>
    </message>
    <message>
        <source>LEDs {first} and {second} are swapped. LEDs 1 to 4 must be in order along the back line, and 5 to 7 and 8 to 10 along the columns in the same direction. Swap their coordinates.</source>
        <translation>LED {first} 和 {second} 互换了：各自在对方的位置上。LED 1 至 4 必须沿后排直线依次排列，5 至 7 和 8 至 10 沿两列同方向依次排列。请交换它们的坐标。</translation>
    </message>
    <message>
        <source>Length: additional error per metre</source>
        <translation>长度：每米附加误差</translation>
    </message>
    <message>
        <source>Line {line} of {file} is damaged. Restore the file from a copy, or remove the line to continue without that image.</source>
        <translation>{file} 第 {line} 行已损坏。请用备份恢复文件，或删除该行，不用那幅图像继续。</translation>
    </message>
    <message>
        <source>Line {line} of {name} begins a document type definition, which is not accepted for security. Remove it; intrinsics files of OpenCV have none.</source>
        <translation>{name} 第 {line} 行开始一个文档类型定义，出于安全原因不予接受。请删除；OpenCV 的内参文件中没有这种定义。</translation>
    </message>
    <message>
        <source>Line {line} of {name} has a list in place of a name. Check that this is the right file.</source>
        <translation>{name} 第 {line} 行应为名称的地方是列表。请检查是否选对了文件。</translation>
    </message>
    <message>
        <source>Line {line} of {name} has the YAML anchor or alias {anchor}, which is not accepted for security. Write the values out.</source>
        <translation>{name} 第 {line} 行有 YAML 锚点或别名 {anchor}，出于安全原因不予接受。请直接写出数值。</translation>
    </message>
    <message>
        <source>Line {line} of {name} has the tag {tag}. For security only plain values and OpenCV matrices are read. Remove the tag, or use a file from a source you trust.</source>
        <translation>{name} 第 {line} 行有标签 {tag}。出于安全原因，只读取普通数值和 OpenCV 矩阵。请删除该标签，或使用来源可信的文件。</translation>
    </message>
    <message>
        <source>Live stream not available at {place}: {reason}. Choose a free port from 1024 to 65535.</source>
        <translation>无法在 {place} 提供实时数据流：{reason}。请选择 1024 到 65535 之间空闲的端口。</translation>
    </message>
    <message>
        <source>Max. change {limit:g} mm is not valid. Enter a value above 0 and up to {most:g} mm.</source>
        <translation>最大变化 {limit:g} mm 无效。请输入大于 0 且不超过 {most:g} mm 的值。</translation>
    </message>
    <message>
        <source>Monte Carlo confirms U: the largest difference is {percent:.0f} % along {axis}, with a standard error of {own:.0f} %.</source>
        <translation>蒙特卡洛法证实了 U：最大差异沿 {axis} 为 {percent:.0f} %，标准误差为 {own:.0f} %。</translation>
    </message>
    <message>
        <source>Monte Carlo gives less: U is {percent:.0f} % larger along {axis} (standard error {own:.0f} %), on the safe side. It counts seat, drift and assumed values in full; each trial corrects what its images show of them.</source>
        <translation>蒙特卡洛法的结果较小：U 沿 {axis} 大 {percent:.0f} %（标准误差 {own:.0f} %），偏于安全。U 全额计入就位、漂移和假定值；每次试验则修正其图像所显示的部分。</translation>
    </message>
    <message>
        <source>Monte Carlo gives more: U is {percent:.0f} % smaller along {axis} (standard error {own:.0f} %). The calibration is not linear within the uncertainties of its files. State U by Monte Carlo, or reduce these uncertainties and tilt the pen farther.</source>
        <translation>蒙特卡洛法的结果较大：U 沿 {axis} 小 {percent:.0f} %（标准误差 {own:.0f} %）。在文件的不确定度范围内标定不是线性的。请按蒙特卡洛法给出 U，或减小这些不确定度并加大倾斜。</translation>
    </message>
    <message>
        <source>Most images show fewer than {n_needed} spots (median {median:.0f}); at least {n_needed} of the {n_leds} LEDs are needed. Check that the LEDs are lit and in the image, and check the exposure.</source>
        <translation>多数图像中的光点少于 {n_needed} 个（中位数 {median:.0f}）；光笔的 {n_leds} 个 LED 中须看到 {n_needed} 个。请检查 LED 是否点亮并在图像内，以及曝光是否合适。</translation>
    </message>
    <message>
        <source>Most images show {n_needed} or more spots, but these do not match the {n_leds} LEDs of the LED file. Check that the LED file belongs to this pen and the intrinsics file to these images.</source>
        <translation>多数图像中有 {n_needed} 个或更多光点，但与含 {n_leds} 个 LED 的 LED 文件不符。请检查该文件是否属于这支光笔，内参文件是否属于这些图像。</translation>
    </message>
    <message>
        <source>Motion blur. Swing the pen more slowly.</source>
        <translation>图像有运动模糊。请放慢摆动。</translation>
    </message>
    <message>
        <source>Next: capture more images. The images of this swing are retained.</source>
        <translation>下一步：继续采集图像。本次摆动的图像会保留。</translation>
    </message>
    <message>
        <source>Next: check that the right tip is fitted, clean and tight, then repeat the swing.</source>
        <translation>下一步：检查所装测头是否正确、清洁、紧固，然后重新摆动。</translation>
    </message>
    <message>
        <source>Next: check the LED file, then repeat the swing.</source>
        <translation>下一步：检查 LED 文件，然后重新摆动。</translation>
    </message>
    <message>
        <source>Next: check the intrinsics file and the LED file, then repeat the swing.</source>
        <translation>下一步：检查内参文件和 LED 文件，然后重新摆动。</translation>
    </message>
    <message>
        <source>Next: check the intrinsics file, then repeat the swing.</source>
        <translation>下一步：检查内参文件，然后重新摆动。</translation>
    </message>
    <message>
        <source>Next: check the rig file, then repeat the swing.</source>
        <translation>下一步：检查相机组文件，然后重新摆动。</translation>
    </message>
    <message>
        <source>Next: continue with this pen and its LED file.</source>
        <translation>下一步：继续使用此光笔及其 LED 文件。</translation>
    </message>
    <message>
        <source>Next: correct the stated cause, then repeat the swing.</source>
        <translation>下一步：排除所述原因，然后重新摆动。</translation>
    </message>
    <message>
        <source>Next: hold the pen with the same tilt at each visit, take more images of a point, or move the camera nearer.</source>
        <translation>下一步：每次以相同的倾斜握持光笔，增加每点的图像数，或将相机移近。</translation>
    </message>
    <message>
        <source>Next: inspect the pen, fix the LED, and measure the LEDs again.</source>
        <translation>下一步：检查光笔，固定该 LED，并重新测量各 LED。</translation>
    </message>
    <message>
        <source>Next: use the points probed between the visits.</source>
        <translation>下一步：使用各次触测漂移参考点之间的测点。</translation>
    </message>
    <message>
        <source>No LED moved relative to the others in {n_swings} swings.</source>
        <translation>在 {n_swings} 次摆动中，没有 LED 相对其他 LED 移动。</translation>
    </message>
    <message>
        <source>No focal length from 0.3 to 12 image widths explains the tracks. Check that the tip stayed in the cone, and tilt the pen in all directions, with roll.</source>
        <translation>0.3 至 12 倍图像宽度的焦距均不能解释这些轨迹。请检查测头是否始终在锥孔中，并将光笔向各方向倾斜且绕轴转动。</translation>
    </message>
    <message>
        <source>No image from camera {serial} for {silence:.0f} s. Check cable and power.</source>
        <translation>相机 {serial} 已有 {silence:.0f} s 没有送来图像。请检查线缆和电源。</translation>
    </message>
    <message>
        <source>No image from camera {serial} for {waited:.1f} s. Check cable and trigger.</source>
        <translation>相机 {serial} 已有 {waited:.1f} s 没有送来图像。请检查线缆和触发。</translation>
    </message>
    <message>
        <source>No image shows the board {board}; the images show {other}, with columns and rows swapped. Specify that board.</source>
        <translation>图像中没有标定板 {board}，看到的是 {other}：列数与行数颠倒了。请指定该标定板。</translation>
    </message>
    <message>
        <source>No pen, no camera and no fixed tip explain the tracks: the residuals are {misfit:.1f} px. Check that the tip stayed in the cone, that the LEDs are fixed to one pen, that camera and cone stand still, and that zoom and focus are locked.</source>
        <translation>没有任何光笔、相机和固定测头能够解释这些轨迹：残差为 {misfit:.1f} px。请检查测头是否始终在锥孔中，LED 是否固定在同一支光笔上，相机和锥孔是否静止，变焦和对焦是否锁定。</translation>
    </message>
    <message>
        <source>No supervisor password is set. Set it at Start, All limits.</source>
        <translation>尚未设置主管密码。请在“开始”步骤的“所有限值”中设置。</translation>
    </message>
    <message>
        <source>No probed points of {name} are given. Give them as {name}=IMAGES, or as a folder of that name.</source>
        <translation>未给出 {name} 的测点。请以 {name}=IMAGES 或同名文件夹给出。</translation>
    </message>
    <message>
        <source>None of the {n_images} images shows the board {board}. The whole board must be in the image, in focus, with a bright border; check its type and number of points.</source>
        <translation>{n_images} 幅图像中均未找到标定板 {board}。整块板须在图像内且清晰，四周留有亮边；请检查其类型和点数。</translation>
    </message>
    <message>
        <source>Not enough tilt {sides}. Tilt the pen further. Images needed: about {n_images}.</source>
        <translation>{sides}倾斜不足。请增大倾斜。还需约 {n_images} 幅图像。</translation>
    </message>
    <message>
        <source>Nothing was fetched: {finding}</source>
        <translation>未取回任何内容：{finding}</translation>
    </message>
    <message>
        <source>On the server: {finding}</source>
        <translation>服务器上：{finding}</translation>
    </message>
    <message>
        <source>Point {number}</source>
        <translation>测点 {number}</translation>
    </message>
    <message>
        <source>Press test without result: {why}</source>
        <translation>压力试验没有结果：{why}</translation>
    </message>
    <message>
        <source>Processing cannot keep up: {n_missed} of {n_offered} images skipped. Close other programs, or capturing takes longer.</source>
        <translation>处理速度不足：{n_offered} 幅图像中有 {n_missed} 幅未处理。请关闭其他程序，否则采集时间更长。</translation>
    </message>
    <message>
        <source>Put the tip into the cone and hold it still, each time with another tilt.</source>
        <translation>把测头放入锥孔并保持不动，每次改变倾斜。</translation>
    </message>
    <message>
        <source>Residuals are large: {sigma:.2f} px; usual is {usual} px or less. Check that the intrinsics file belongs to this camera, lens and focus, and the LED file to this pen.</source>
        <translation>残差过大：{sigma:.2f} px，通常不超过 {usual} px。请检查内参文件是否属于此相机、镜头和对焦，LED 文件是否属于此光笔。</translation>
    </message>
    <message>
        <source>Residuals {noise:.3f} px in this image, {usual:.3f} px in the others. Check for fingers or reflections at the LEDs.</source>
        <translation>本图像残差 {noise:.3f} px，其他图像 {usual:.3f} px。请检查 LED 是否被手指遮挡或有反光。</translation>
    </message>
    <message>
        <source>Ring, plate: form and out-of-plane deviation</source>
        <translation>圆环、平板：形状误差和面外偏差</translation>
    </message>
    <message>
        <source>Risk of a wrong decision</source>
        <translation>误判风险</translation>
    </message>
    <message>
        <source>Self-check of the LEDs {value:.2f}, limit {limit:.2f}: errors follow the posture, so LEDs, pen or lens deviate from the model and U may be too small. Check for bent LEDs, a loose pen and a window before the lens, then verify the tip.</source>
        <translation>LED 自检 {value:.2f}，限值 {limit:.2f}：误差随姿态变化，说明 LED、光笔或镜头与模型不符，U 可能偏小。请检查 LED 是否弯曲、光笔是否松动、镜头前是否有窗玻璃，然后验证测头。</translation>
    </message>
    <message>
        <source>Settings not saved: {file} cannot be written ({reason}). Check free space and write permission of its folder.</source>
        <translation>无法保存设置：无法写入 {file}（{reason}）。请确认您对其文件夹有写入权限，且磁盘未满。</translation>
    </message>
    <message>
        <source>Settings saved, but another program had locked {file} for {seconds:g} s. End that program if it hangs; it may overwrite the settings.</source>
        <translation>设置已保存，但另一个程序将 {file} 锁定了 {seconds:g} s。如果该程序无响应，请结束它，否则它可能覆盖设置。</translation>
    </message>
    <message>
        <source>Simulated plate</source>
        <translation>模拟平板</translation>
    </message>
    <message>
        <source>Swing: pen temperature</source>
        <translation>摆动：光笔温度</translation>
    </message>
    <message>
        <source>The GenTL producer {file} does not load: {why}. Choose the 64-bit producer of this camera for this system.</source>
        <translation>无法加载 GenTL 生产者 {file}：{why}。请选择适用于此相机、此系统和 64 位的生产者。</translation>
    </message>
    <message>
        <source>The LED coordinates are in error by {sigma:.3f} mm (standard deviation); this alone gives U (k = 2) = {uncertainty:.4f} mm. Check that the LED file belongs to this pen. More images hardly help.</source>
        <translation>LED 坐标的误差约为 {sigma:.3f} mm（标准差），仅此即使 U (k = 2) = {uncertainty:.4f} mm。请检查 LED 文件是否属于此光笔。增加图像作用不大。</translation>
    </message>
    <message>
        <source>The LED layout of this pen is symmetric, so the LEDs cannot be identified. Move an LED, or give the LED centres.</source>
        <translation>这支光笔的 LED 布局对称，无法识别各 LED。请移动一个 LED，或直接给出 LED 中心。</translation>
    </message>
    <message>
        <source>The LEDs are a mirror image of the pen: seen from the front with LED 4 above LED 1, LEDs 5 to 7 must be on the left and 8 to 10 on the right. If the machine&apos;s axes are left-handed, change the sign of one coordinate; if the columns are swapped, renumber them.</source>
        <translation>LED 是光笔的镜像：从正面看，LED 4 在 LED 1 上方时，LED 5 至 7 必须在左，8 至 10 在右。若测量机坐标轴为左手系，请改变一个坐标的符号；若两列互换，请重新编号。</translation>
    </message>
    <message>
        <source>The LEDs are collinear within {off_line:.2f} mm over {extent:.0f} mm; a rotation about this line is not observable. At least one LED must be {needed:.1f} mm from the line.</source>
        <translation>LED 在 {extent:.0f} mm 长度内偏离直线不超过 {off_line:.2f} mm，因此看不出绕该直线的转动。至少有一个 LED 须偏离直线 {needed:.1f} mm。</translation>
    </message>
    <message>
        <source>The LEDs are not in the pen frame: LED {led} is {distance:.2f} mm from its nominal position (origin in front of LED 1, y along LEDs 1-4, LEDs 5-10 at z = 0). Transform measuring machine coordinates to the pen frame.</source>
        <translation>LED 不在光笔坐标系中：LED {led} 与规定位置相差 {distance:.2f} mm（原点在 LED 1 前方，y 轴沿 LED 1-4，LED 5-10 位于 z = 0）。请将测量机坐标转换到光笔坐标系。</translation>
    </message>
    <message>
        <source>The LEDs are {width:.0f} px wide in the images, too small to show whether their faces are flat. The light of a dome comes from up to {depth:.2f} mm behind its disc. U refers to the light as seen, which is also what this pen measures with at about this distance. To refer the tip to the discs, use flat LEDs or images in which they are larger.</source>
        <translation>LED 图像宽 {width:.0f} px，太小，无法显示其发光面是否为平面。圆顶 LED 的光看起来来自其圆片后方，最多 {depth:.2f} mm。U 以所见的光为准，光笔在大致相同的距离测量时也以此为准。如需使测头以圆片为基准，请使用平面 LED，或使其图像更大。</translation>
    </message>
    <message>
        <source>The LEDs are {width:.1f} px wide in most images; at least {needed:.0f} px are needed. Bring the camera nearer, or use a longer focal length or a camera of higher resolution.</source>
        <translation>大多数图像中 LED 宽度为 {width:.1f} px；至少需要 {needed:.0f} px。请将相机移近，或使用更长的焦距或更高分辨率的相机。</translation>
    </message>
    <message>
        <source>The archive {file} does not exist or is empty. Check the data folder.</source>
        <translation>没有档案 {file}，或其中尚无任何条目。请检查数据文件夹。</translation>
    </message>
    <message>
        <source>The archive {name} has been locked by another program for {seconds} s. Let that program finish or end it, then try again.</source>
        <translation>档案 {name} 被另一程序占用已超过 {seconds} s。请等该程序完成或将其结束，然后重试。</translation>
    </message>
    <message>
        <source>The archive {name} is not available: {reason}. Check free space and write permission of the disk, or the server, user and password.</source>
        <translation>档案库 {name} 不可用：{reason}。请检查磁盘空间和写入权限，或服务器、用户名和密码。</translation>
    </message>
    <message>
        <source>The archive {name} was written by a later version of the program. Use that version. The archive was not changed.</source>
        <translation>档案库 {name} 由更新版本的程序写入。请使用该版本。档案库未作更改。</translation>
    </message>
    <message>
        <source>The ball is larger than the feature {name}. Check the ball diameter, and the side in the plan.</source>
        <translation>测球大于要素 {name}。请检查测球直径以及计划中的内外侧。</translation>
    </message>
    <message>
        <source>The board {text} has {columns} x {rows} points or squares; {least} to {most} are needed along each side. Count them again; of a chessboard count the inner corners.</source>
        <translation>标定板 {text} 有 {columns} x {rows} 个点或方格；每边需要 {least} 至 {most} 个。请重新计数；棋盘格请数内角点。</translation>
    </message>
    <message>
        <source>The board {text} names an unknown dictionary of markers. Name the dictionary as in OpenCV, such as DICT_5X5_100.</source>
        <translation>标定板 {text} 给出的标记字典未知。请按 OpenCV 命名，例如 DICT_5X5_100。</translation>
    </message>
    <message>
        <source>The board {text} needs {needed} markers; {dictionary} has {known}. Name the dictionary of the print.</source>
        <translation>标定板 {text} 需要 {needed} 个标记；{dictionary} 有 {known} 个。请给出印制时的字典。</translation>
    </message>
    <message>
        <source>The calibration of this tip expired on {due}. Calibrate it again.</source>
        <translation>此测头的标定已于 {due} 到期。请重新标定。</translation>
    </message>
    <message>
        <source>The calibration {path} was modified or damaged after it was written. Restore it from a copy, or calibrate again.</source>
        <translation>标定结果 {path} 与写出时不同：此后被改动或损坏。请从副本恢复，或重新标定。</translation>
    </message>
    <message>
        <source>The camera calibration in {file} was modified or damaged after it was written. Restore the file from a copy.</source>
        <translation>{file} 中的相机标定与写入时不同：之后被更改或损坏。请从副本恢复该文件。</translation>
    </message>
    <message>
        <source>The camera changed during the swing: its focal length was {first:.0f} px first and {second:.0f} px later. Lock zoom, focus and image stabilisation, and repeat the swing.</source>
        <translation>相机在摆动期间发生了变化：焦距先为 {first:.0f} px，后为 {second:.0f} px。请锁定变焦、对焦和防抖，然后重新摆动。</translation>
    </message>
    <message>
        <source>The intrinsics file belongs to camera {stated}; the camera in use is {used}. Give the file of this camera.</source>
        <translation>内参文件属于相机 {stated}，而当前使用的相机是 {used}。请提供该相机的文件。</translation>
    </message>
    <message>
        <source>The intrinsics file is off: it states a focal length of {stated:.0f} px ({off:+.1f} %); by the swing it is {found:.0f} px. Check that the file is of this camera, zoom and focus; use the file written now.</source>
        <translation>内参文件有偏差：文件给出的焦距为 {stated:.0f} px（{off:+.1f} %），由摆动得到的焦距为 {found:.0f} px。请检查文件是否属于这台相机及其变焦和对焦；请使用现在写出的文件。</translation>
    </message>
    <message>
        <source>The intrinsics file of {camera} contradicts the images of the board: residuals of {rms:.1f} px (RMS). The file is of another camera or zoom, or has a lens model that does not fit this lens, such as a plain one for a fisheye. Check it, or calibrate the cameras from these images.</source>
        <translation>{camera} 的内参文件与标定板图像矛盾：残差为 {rms:.1f} px（均方根）。该文件属于另一台相机或另一变焦，或其镜头模型不适合此镜头，例如将普通模型用于鱼眼镜头。请检查该文件，或用这些图像标定相机。</translation>
    </message>
    <message>
        <source>The camera link loses images: {n_incomplete} of {n_sent} incomplete, {n_missed} lost. Lower the frame rate, use a smaller region or larger packets, or check cable and switch.</source>
        <translation>到相机的链路丢失图像：{n_sent} 幅中有 {n_incomplete} 幅不完整，{n_missed} 幅未到达。请降低帧率，使用更小的区域或更大的数据包，或检查线缆和交换机。</translation>
    </message>
    <message>
        <source>(max - min) / 2</source>
        <translation>（最大 - 最小）/ 2</translation>
    </message>
    <message>
        <source>(max - min) / 2 of the point over all postures: u {u:.4f}, v {v:.4f}, w {w:.4f} mm.</source>
        <translation>各姿态下该点的（最大 - 最小）/ 2：u {u:.4f}，v {v:.4f}，w {w:.4f} mm。</translation>
    </message>
    <message>
        <source>No centre in {name} is beyond {size:.3g}: they seem to be shares of the image, or in mm on the sensor. Write them in pixels, (0, 0) being the centre of the first.</source>
        <translation>{name} 中的所有中心都不超过 {size:.3g}：它们似乎是占图像的比例，或传感器上的毫米数。请以像素为单位写出，(0, 0) 为第一个像素的中心。</translation>
    </message>
    <message>
        <source>An LED file needs one known length. Measure the distance between two LEDs and state it.</source>
        <translation>LED 文件需要一个已知长度。请测量并给出两个 LED 的间距。</translation>
    </message>
    <message>
        <source>Does not verify the tip: all points were probed in alike postures, which show no tip error. Tilt the pen to all sides.</source>
        <translation>未验证测头：所有点都以相近的姿态测得，无法显示测头误差。请将光笔向各个方向倾斜。</translation>
    </message>
    <message>
        <source>Does not verify the tip: these points show only a tip error above {detectable:.4f} mm (probability 95 %), the limit is {limit:.4f} mm. Tilt the pen more, to all sides.</source>
        <translation>未验证测头：这些点只能显示大于 {detectable:.4f} mm 的测头误差（概率 95 %），限值为 {limit:.4f} mm。请将光笔向各个方向更多倾斜。</translation>
    </message>
    <message>
        <source>Error of the tip</source>
        <translation>测头误差</translation>
    </message>
    <message>
        <source>It is a whole project: save the calibration of the one camera by Tools, Camera Calibration, Save, as XML.</source>
        <translation>它是整个项目：请通过 Tools、Camera Calibration、Save 将这一台相机的标定保存为 XML。</translation>
    </message>
    <message>
        <source>It names the files of its cameras: choose that of the camera that observes the pen.</source>
        <translation>它列出了各相机的文件：请选择观测光笔的相机的文件。</translation>
    </message>
    <message>
        <source>Its distortion is not that of OpenCV or of Kannala and Brandt: calibrate the camera from the images of its board, here or with one of these models.</source>
        <translation>其畸变不是 OpenCV 或 Kannala-Brandt 的模型：请用标定板图像标定相机，可在此处，或采用其中一种模型。</translation>
    </message>
    <message>
        <source>LEDs {first} and {second} are {distance:.2f} mm apart, too close for discs of {diameter:g} mm. Check the unit of the coordinates (mm, cm or in), and the diameter.</source>
        <translation>LED {first} 和 {second} 相距 {distance:.2f} mm，对 {diameter:g} mm 的发光面来说太近。请检查坐标的单位（mm、cm 或英寸）和直径。</translation>
    </message>
    <message>
        <source>Lean the pen as the dial shows</source>
        <translation>按姿态盘所示倾斜光笔</translation>
    </message>
    <message>
        <source>Lean the pen in the cone to all sides</source>
        <translation>在锥孔中向各方向倾斜光笔</translation>
    </message>
    <message>
        <source>Move {axis}</source>
        <translation>位移 {axis}</translation>
    </message>
    <message>
        <source>Probe {what}: {n_points} of {needed} points.</source>
        <translation>触测{what}：{n_points} / {needed} 个点。</translation>
    </message>
    <message>
        <source>Standard deviation {axis}</source>
        <translation>标准偏差 {axis}</translation>
    </message>
    <message>
        <source>The LED centres reach from {near} to ({x:.0f}, {y:.0f}) px, the intrinsics file was made for {width} x {height} px. Choose the file for this camera; (0, 0) px must be the top left pixel.</source>
        <translation>LED 中心的范围是 {near} 至 ({x:.0f}, {y:.0f}) px，而内参文件适用于 {width} × {height} px。请选择这台相机的文件；(0, 0) px 必须是左上角的像素。</translation>
    </message>
    <message>
        <source>The camera moved during the swing: fixed lamps in view and the pen shifted by {shift:.2f} px. The result is corrected. Clamp the camera and let it warm up.</source>
        <translation>相机在摆动过程中移动：视野中的固定灯和光笔偏移 {shift:.2f} px。结果已修正。请固定相机，并让其充分预热。</translation>
    </message>
    <message>
        <source>The camera was calibrated at {stated:.1f} °C; the station is at {used:.1f} °C. Check the camera by a swing, or calibrate it at this temperature.</source>
        <translation>相机标定时为 {stated:.1f} °C，工位现为 {used:.1f} °C。请用一次摆动检查，或在此温度下重新标定。</translation>
    </message>
    <message>
        <source>The camera was calibrated {age} days ago, on {day}. Check the camera by a swing, or calibrate it again.</source>
        <translation>相机标定于 {age} 天前（{day}）。请用一次摆动检查，或重新标定。</translation>
    </message>
    <message>
        <source>The cameras are not synchronised: exposures are {lag:.1f} ms apart. At 100 mm/s the pen moves {way:.2f} mm in this time, {px:.1f} px in the image. Trigger both cameras by one signal.</source>
        <translation>两台相机不同步：曝光时刻相差 {lag:.1f} ms。光笔以 100 mm/s 运动时，其间移动 {way:.2f} mm，在图像中为 {px:.1f} px。请用同一信号触发两台相机。</translation>
    </message>
    <message>
        <source>The cameras are not synchronised: exposures are {lag:.1f} ms apart. At 100 mm/s the pen moves {way:.2f} mm in this time. Trigger both cameras by one signal.</source>
        <translation>两台相机不同步：曝光时刻相差 {lag:.1f} ms。光笔以 100 mm/s 运动时，其间移动 {way:.2f} mm。请用同一信号触发两台相机。</translation>
    </message>
    <message>
        <source>The centres of all images lie within {extent:.1f} px; the images have {width} x {height} px. Give the centres in pixels, and check the size of the images.</source>
        <translation>所有图像的中心都在 {extent:.1f} px 之内，而图像为 {width} × {height} px。请以像素给出中心，并检查图像尺寸。</translation>
    </message>
    <message>
        <source>The characteristic {name} is not defined for features of this kind or number. Check the plan.</source>
        <translation>特性 {name} 对此类或此数量的要素没有定义。请检查计划。</translation>
    </message>
    <message>
        <source>The cone has {n_touches} usable points, at least {needed} are needed, {usual} are usual. Probe it again, each time in another posture.</source>
        <translation>锥孔有 {n_touches} 个可用的测点，至少需要 {needed} 个，通常为 {usual} 个。请再次触测，每次换一个姿态。</translation>
    </message>
    <message>
        <source>The cone moved by {distance:.4f} mm relative to the camera during the swing; U includes this. Clamp both, let the camera warm up, and repeat the swing.</source>
        <translation>摆动期间锥孔相对相机移动了 {distance:.4f} mm，已计入 U。请将两者夹紧，待相机预热后重新摆动。</translation>
    </message>
    <message>
        <source>The copy of chain {chain} in this archive is damaged. Check the archive.</source>
        <translation>本档案中链 {chain} 的副本已损坏。请检查档案。</translation>
    </message>
    <message>
        <source>The covariance of the lens field of {name} is not a covariance matrix: it must be symmetric, with correlations from -1 to 1. Correct or remove the entry lens_field.</source>
        <translation>{name} 中镜头残差场的协方差不是协方差矩阵：它必须对称，且相关系数在 -1 到 1 之间。请更正或删除条目 lens_field。</translation>
    </message>
    <message>
        <source>The difference from the previous tip is accepted up to {gate:g} times U (k = 2) of the difference along each axis (an unchanged tip is accepted in 95 % of all cases); beyond it, or where the previous tip cannot be read, the verdict is CHECK. A CHECK can be accepted only with a reason, a REPEAT not at all.</source>
        <translation>与前一测头之差，各轴均不超过该差值 U (k = 2) 的 {gate:g} 倍时予以接受（测头未变时，接受的概率为 95 %）；超出此值，或无法读取前一测头时，判为“需检查”。“需检查”须说明理由才能接受，“重新摆动”不得接受。</translation>
    </message>
    <message>
        <source>The distortion coefficients of {name} fold the image of {width} x {height} px: much of it has no direction of view, or two. Check them, or calibrate the camera again with views that reach into the corners.</source>
        <translation>{name} 的畸变系数使 {width} x {height} px 的图像折叠：其中很大部分没有视线方向，或有两个。请检查这些系数，或用伸入图像四角的视图重新标定相机。</translation>
    </message>
    <message>
        <source>The distortion of the intrinsics file has no inverse in {share:.1f} % of the image, at its corners. LEDs there are not used; calibrate the camera with views that reach into the corners.</source>
        <translation>内参文件的畸变在图像四角处（图像的 {share:.1f} %）不可逆。那里的 LED 不予使用；请用伸入四角的视图标定相机。</translation>
    </message>
    <message>
        <source>The distortion of the intrinsics file is not invertible for some image points: its coefficients fold the image. Check the distortion coefficients, or calibrate the camera again.</source>
        <translation>内参文件的镜头畸变在某些像点无法消除：其系数使图像折叠。请检查畸变系数，或重新标定相机。</translation>
    </message>
    <message>
        <source>The distortion that fits the LEDs folds the image beyond them: some pixels would have no direction of view. Move the pen over the whole image, also into the corners, and repeat the swing.</source>
        <translation>与 LED 拟合的畸变会使其范围之外的图像折叠：有些像素没有视线方向。请让光笔移遍整个图像，包括边角，并重新摆动。</translation>
    </message>
    <message>
        <source>The drift reference stays within {distance:.4f} mm (U {uncertainty:.4f} mm, limit {limit:.4f} mm).</source>
        <translation>漂移参考点的移动在 {distance:.4f} mm 以内（U {uncertainty:.4f} mm，限值 {limit:.4f} mm）。</translation>
    </message>
    <message>
        <source>The drift reference stays within {distance:.4f} mm, but its U is {uncertainty:.4f} mm, more than the limit of {limit:.4f} mm: a drift of that size would not be detected.</source>
        <translation>漂移参考点的移动不超过 {distance:.4f} mm，但其 U 为 {uncertainty:.4f} mm，大于限值 {limit:.4f} mm：这样大小的漂移无法察觉。</translation>
    </message>
    <message>
        <source>The drift reference was visited once; drift needs two visits or more. Probe it before, during and after the session.</source>
        <translation>漂移参考点只触测了一次；确定漂移至少需要两次。请在工作之前、期间和之后各触测一次。</translation>
    </message>
    <message>
        <source>The estimated distortion folds the image in its corners, where no view shows the board. Add views with the board in each corner of the image.</source>
        <translation>由这些视图得出的畸变使图像在角部翻折，而那里没有视图显示标定板。请补充标定板位于图像各角的视图。</translation>
    </message>
    <message>
        <source>The feature {name} has {n_touches} probed points; the plan needs {needed}. Probe the missing points.</source>
        <translation>要素 {name} 有 {n_touches} 个测点；计划需要 {needed} 个。请触测缺少的点。</translation>
    </message>
    <message>
        <source>The file {file} has no entry in the archive yet. Start the program to enter it.</source>
        <translation>文件 {file} 在档案中尚无记录。请启动程序进行登记。</translation>
    </message>
    <message>
        <source>The file {file} of entry {number} was modified after it was entered.</source>
        <translation>第 {number} 个条目的文件 {file} 与录入时不符。</translation>
    </message>
    <message>
        <source>The file {path} cannot be read: {reason}. Check the name and the read permission.</source>
        <translation>文件 {path} 无法读取：{reason}。请检查名称和读取权限。</translation>
    </message>
    <message>
        <source>The folder {folder} cannot be created: {reason}. Check the write permission.</source>
        <translation>无法创建文件夹 {folder}：{reason}。请确认您有写入权限。</translation>
    </message>
    <message>
        <source>The folder {folder} cannot be read: {reason}. Its interrupted swings are not listed. Check the read permission.</source>
        <translation>文件夹 {folder} 无法读取：{reason}。其中未完成的摆动不会列出；请确认您有读取权限。</translation>
    </message>
    <message>
        <source>The folder {folder} contains no images that are read, but other files ({count}). {name} is of the kind {kind}. Save its images as PNG or TIFF, under names that end so, or choose a video itself.</source>
        <translation>文件夹 {folder} 中没有可读取的图像，但有其他文件（{count} 个）。{name} 是 {kind} 类型的文件。请将其中的图像保存为 PNG 或 TIFF，并使用相应的扩展名；视频请直接选择文件本身。</translation>
    </message>
    <message>
        <source>The folder {folder} contains no images, but folders: {inner}. Choose the one with the images.</source>
        <translation>文件夹 {folder} 中没有图像，但有文件夹：{inner}。请选择包含图像的那一个。</translation>
    </message>
    <message>
        <source>The folder {folder} is not empty. Choose another folder for this swing; nothing is overwritten.</source>
        <translation>文件夹 {folder} 不是空的。请为本次摆动选择其他文件夹；不会覆盖任何内容。</translation>
    </message>
    <message>
        <source>The folder {folder} is not empty: it contains {example}. Choose another folder, or empty it; nothing is overwritten.</source>
        <translation>文件夹 {folder} 不是空的：其中有 {example}。请选择其他文件夹，或将其清空；不会覆盖任何内容。</translation>
    </message>
    <message>
        <source>The images contradict the LED file: the standard deviation of its coordinates is {found:.4f} mm, stated {stated:.4f} mm. Measure the pen again, or check that the file belongs to this pen.</source>
        <translation>图像与 LED 文件矛盾：其坐标的标准差为 {found:.4f} mm，文件给出 {stated:.4f} mm。请重新测量光笔，或检查该文件是否属于此光笔。</translation>
    </message>
    <message>
        <source>The images contradict the LED file: {numbers}. Check that the file belongs to this pen and is in mm, or measure the pen again.</source>
        <translation>图像与 LED 文件矛盾：{numbers}。请检查文件是否属于这支光笔且以 mm 为单位，或重新测量光笔。</translation>
    </message>
    <message>
        <source>The images contradict the intrinsics file: {numbers}. Check that the file belongs to this camera, lens and focus, or calibrate the camera again.</source>
        <translation>图像与内参文件矛盾：{numbers}。请检查该文件是否属于此相机、镜头和对焦，或重新标定相机。</translation>
    </message>
    <message>
        <source>The images contradict the rig file in camera {camera}: {numbers}. Check that no camera was moved, or calibrate the rig again.</source>
        <translation>图像与相机组文件中相机 {camera} 的数值矛盾：{numbers}。请检查是否有相机被移动，或重新标定相机组。</translation>
    </message>
    <message>
        <source>The images contradict the rig file or the scale of the LED file in camera {camera}: {numbers}. A wrong base looks like a wrong scale. Check that no camera was moved and that both files belong together, then measure the pen or calibrate the rig again.</source>
        <translation>图像与相机组文件中相机 {camera} 的数值或 LED 文件的尺度矛盾：{numbers}。错误的基线与错误的尺度表现相同。请检查相机未被移动且两个文件配套，然后重新测量光笔或标定相机组。</translation>
    </message>
    <message>
        <source>The images do not decide between the pen and its mirror image. Tilt the pen further towards the camera and away from it, by 30 degrees or more, and come closer to the camera.</source>
        <translation>图像不能区分光笔及其镜像。请将光笔朝向和背离相机进一步倾斜 30 度或以上，并靠近相机。</translation>
    </message>
    <message>
        <source>The images do not determine the tip yet. Tilt the pen to all sides.</source>
        <translation>目前的图像还不能确定测头位置。请向各个方向倾斜光笔。</translation>
    </message>
    <message>
        <source>The images of one camera arrived late; recent image pairs are {moved:.0f} ms apart in time. Pairing is correct again. Images that do not agree are excluded from the result. Check them in Review, or repeat the swing.</source>
        <translation>一台相机的图像延迟到达，最近的图像对相差 {moved:.0f} ms。配对现已恢复正确。不相符的图像不计入结果。请在“复核”中检查，或重新摆动。</translation>
    </message>
    <message>
        <source>The images show the board {board} mirrored. Turn off mirroring of the camera, or print the board again.</source>
        <translation>图像中的标定板 {board} 是镜像的。请关闭相机的镜像功能，或重新打印标定板。</translation>
    </message>
    <message>
        <source>The intrinsics_covariance of {name} is not a covariance matrix: it must be symmetric, with correlations from -1 to 1. Correct or remove it.</source>
        <translation>{name} 的 intrinsics_covariance 不是协方差：必须对称，相关系数在 -1 到 1 之间。请改正或删除。</translation>
    </message>
    <message>
        <source>The joint fit did not converge in {n_steps} iterations. Check that both files belong to this pen and camera.</source>
        <translation>联合拟合在 {n_steps} 次迭代内未收敛。请检查两个文件是否属于这支光笔和这台相机。</translation>
    </message>
    <message>
        <source>The lamp at {x:.0f}, {y:.0f} px moved by {shift:.2f} px during the swing, but the pen did not. No correction is made. Fix or cover the lamp.</source>
        <translation>位于 {x:.0f}, {y:.0f} px 的灯在摆动过程中移动了 {shift:.2f} px，而光笔没有随之移动。未作任何扣除。请固定该灯，或将其遮住。</translation>
    </message>
    <message>
        <source>The lengths of the board {text} are not valid: they must be above 0 mm, and markers or circles smaller than their squares. Measure them again.</source>
        <translation>标定板 {text} 的尺寸不合理：单位为 mm，须大于 0，且标记或圆须小于其所在的格子。请重新测量。</translation>
    </message>
    <message>
        <source>The limits in {file} were modified or damaged after they were saved. Restore the file from a copy.</source>
        <translation>{file} 中的限值在保存后被更改或损坏。请从副本恢复该文件。</translation>
    </message>
    <message>
        <source>The limits in {file} were written by a later version of the program. Use that version.</source>
        <translation>{file} 中的限值由更新版本的程序写入。请使用该版本。</translation>
    </message>
    <message>
        <source>The limits were changed in another window after they were shown here. Nothing was saved. Read the present limits, then change them again.</source>
        <translation>限值在此处显示后已在另一个窗口中更改。未保存任何内容。请查看当前限值，然后重新更改。</translation>
    </message>
    <message>
        <source>The line of the alignment is perpendicular to its plane and defines no direction in it. Choose another line.</source>
        <translation>找正所用直线垂直于其平面，不能在平面内定出方向。请选择另一条直线。</translation>
    </message>
    <message>
        <source>The local entries do not continue with {entry}. A data folder was copied and both copies were used, or entries were modified. Check both archives.</source>
        <translation>此处保存的内容与{entry}不相接。可能是数据文件夹被复制后两份都在继续使用，或条目被改动过。请检查两边的档案库。</translation>
    </message>
    <message>
        <source>The measuring plan {name} is not valid: {found}. Correct the plan; docs/measuring.md describes its entries.</source>
        <translation>测量计划 {name} 无效：{found}。请更正计划；docs/measuring.md 说明其条目。</translation>
    </message>
    <message>
        <source>The next image of {place} follows in {seconds:.1f} s. Wait, or replay the images faster.</source>
        <translation>{place} 的下一幅图像还要 {seconds:.1f} s。请等待，或加快回放。</translation>
    </message>
    <message>
        <source>The nominal centre of tip {tip} is not valid. Each coordinate must be within {most:g} mm of the origin of the pen frame.</source>
        <translation>测头 {tip} 的标称中心不可能如此：各坐标距光笔坐标系原点最多 {most:g} mm。</translation>
    </message>
    <message>
        <source>The password has {length} characters. Enter at least {needed}.</source>
        <translation>密码有 {length} 个字符。请至少输入 {needed} 个。</translation>
    </message>
    <message>
        <source>The pen hardly moved: its postures differ by {found:.1f}° (RMS); {needed:.0f}° are needed. Tilt the pen to all sides by 20° or more, and turn it about its own axis.</source>
        <translation>光笔几乎没有动：各姿态仅相差 {found:.1f}°（均方根），需要 {needed:.0f}°。请把光笔向各个方向倾斜 20° 以上，并绕自身轴线转动。</translation>
    </message>
    <message>
        <source>The pen is lifted. Put the tip back to continue.</source>
        <translation>光笔已抬起。放回测头即可继续。</translation>
    </message>
    <message>
        <source>The pen rests. Pick it up: a point counts once the pen has moved.</source>
        <translation>光笔静止未动。请拿起光笔：光笔移动之后测点才计入。</translation>
    </message>
    <message>
        <source>The pen was lifted or moved before the point was recorded, so it does not count. Hold it still until it is recorded.</source>
        <translation>测点记录之前光笔被抬起或移动，因此不计入。请保持不动直到记录完成。</translation>
    </message>
    <message>
        <source>The pen was swung about one axis only, {axis}: this axis turned by {found:.1f}° (RMS); {needed:.0f}° are needed, so the tip along it is not determined. {advice}</source>
        <translation>光笔只绕一根轴摆动，即{axis}：该轴本身只转动了 {found:.1f}°（均方根），需要 {needed:.0f}°，因此测头沿该轴的位置无法确定。{advice}</translation>
    </message>
    <message>
        <source>The points are up to {off:.3g} mm off a {kind}. Check the kind in the plan, and whether a point lies elsewhere.</source>
        <translation>各点偏离{kind}达 {off:.3g} mm。请检查测量计划中的要素类型，以及是否有点位于别处。</translation>
    </message>
    <message>
        <source>The points do not determine a {kind}. Distribute them over more of its surface.</source>
        <translation>这些点不能确定{kind}。请使其分布在更大的表面范围。</translation>
    </message>
    <message>
        <source>The points do not match a flat board {board}: its squares differ from the description, or the images are from different cameras. Count and measure the squares again.</source>
        <translation>没有相机会把平整标定板 {board} 看成这些点的样子：格子与所指定的不符，或图像不是同一相机拍摄。请重新数并测量格子。</translation>
    </message>
    <message>
        <source>The poses have no common tip: the best fit scatters by {scatter:.0f} mm, with the poses {movement:.0f} mm apart. Check that they belong to one pen swung on its tip, that they are cam_from_pen, and that rotations and translations belong together.</source>
        <translation>这些位姿没有共同的测头：最佳结果的散布为 {scatter:.0f} mm，而位姿本身彼此相距 {movement:.0f} mm。请检查：位姿是否来自同一支绕测头摆动的光笔，是否以 cam_from_pen 给出，旋转与平移是否对应。</translation>
    </message>
    <message>
        <source>The postures differ by {found:.1f} degrees (rms), {needed:.0f} are needed to verify a tip. Tilt the pen to all sides.</source>
        <translation>各姿态相差 {found:.1f}°（均方根），验证测头需要 {needed:.0f}°。请向各个方向倾斜光笔。</translation>
    </message>
    <message>
        <source>The record of {entry} is missing or was modified. Import the entries from their station again.</source>
        <translation>{entry}的标定数据缺失或被改动过。请从其工位重新获取这些条目。</translation>
    </message>
    <message>
        <source>The record {name} contains no images. Resume the swing, or start a new one.</source>
        <translation>记录 {name} 中没有图像。请继续该摆动，或开始新的摆动。</translation>
    </message>
    <message>
        <source>The result file of tip {tip}, pen {pen}, is missing in {folder}. Restore it from a copy.</source>
        <translation>测头 {tip}（光笔 {pen}）的结果文件已不在 {folder} 中。请从备份恢复。</translation>
    </message>
    <message>
        <source>The result is outside the limits of this station. {why} A supervisor&apos;s approval and a reason are needed.</source>
        <translation>结果超出本工位的限值。{why}须由主管批准并说明理由。</translation>
    </message>
    <message>
        <source>The result {file} is damaged. Restore it from a copy, or move it away to continue without it.</source>
        <translation>结果 {file} 已损坏。请用备份恢复，或移走后不用它继续。</translation>
    </message>
    <message>
        <source>The result {file} was written by a later version of the program (format {number}; this version reads up to {known}). Use that version, or move the file away to continue without it.</source>
        <translation>结果 {file} 由更新版本的程序写入（格式 {number}；本版本最高读取 {known}）。请使用该版本，或移走该文件后不用它继续。</translation>
    </message>
    <message>
        <source>The rotations seem to be converted from quaternions in the wrong order (w x y z or x y z w): the poses scatter by {as_read:.3g} mm about one tip as given, by {undone:.3g} mm in the other order. Convert them again with the scalar in its place.</source>
        <translation>旋转似乎由四元数按错误的顺序（w x y z 或 x y z w）换算而来：按现有数据，各位姿的测头散布为 {as_read:.3g} mm，改用另一顺序则为 {undone:.3g} mm。请将标量放在正确的位置后重新换算。</translation>
    </message>
    <message>
        <source>The rotations seem transposed: the poses scatter by {as_read:.3g} mm about one tip as given, by {undone:.3g} mm transposed. Give r11 to r33 row by row, with rotation and translation of cam_from_pen.</source>
        <translation>旋转矩阵似乎被转置：按现有数据，各位姿的测头散布为 {as_read:.3g} mm，转置后为 {undone:.3g} mm。请按行给出 r11 至 r33，且旋转与平移均为 cam_from_pen。</translation>
    </message>
    <message>
        <source>The same as {name}.</source>
        <translation>与 {name} 相同。</translation>
    </message>
    <message>
        <source>The selected files or names are not those of the swing. Select them, then repeat the press test.</source>
        <translation>所选文件或名称与该摆动的不同。请先选择，再重做压力试验。</translation>
    </message>
    <message>
        <source>The server has the chains of several stations: {chains}. Choose one.</source>
        <translation>服务器有多个工位的链：{chains}。请选择其一。</translation>
    </message>
    <message>
        <source>The server has {there} entries of this station, this data folder only {here}: it was replaced by an older copy. Nothing was delivered. Fetch the missing entries from the server.</source>
        <translation>服务器有本工位的 {there} 条记录，而本数据文件夹只有 {here} 条：它被较旧的副本替换。未传送任何内容。请从服务器取回缺失的记录。</translation>
    </message>
    <message>
        <source>The server {name} has no entries of this station. Check the address and the user.</source>
        <translation>服务器 {name} 没有本工位的记录。请检查地址和用户。</translation>
    </message>
    <message>
        <source>The settings {file} are damaged and were renamed to {aside}. Restore them from a copy, or enter the settings again.</source>
        <translation>设置文件 {file} 已损坏，已改名为 {aside}。请用备份恢复，或重新输入设置。</translation>
    </message>
    <message>
        <source>The sign of t{axis} seems wrong: the poses scatter by {as_read:.3g} mm about one tip as given, by {undone:.3g} mm with the other sign. Give rotations and translations in the same right-handed frame.</source>
        <translation>t{axis} 的符号似乎有误：按现有数据，各位姿的测头散布为 {as_read:.3g} mm，改变符号后为 {undone:.3g} mm。请在同一右手坐标系中给出旋转和平移。</translation>
    </message>
    <message>
        <source>The signature of entry {number} of chain {chain} is missing or wrong: the entry or its signature was changed.</source>
        <translation>链 {chain} 的第 {number} 条记录的签名缺失或错误：记录或其签名被更改。</translation>
    </message>
    <message>
        <source>The station key {file} was changed or damaged. Restore it from a copy, or remove it and let a supervisor introduce another (documents: security).</source>
        <translation>工位密钥 {file} 被更改或损坏。请从副本恢复，或删除后由主管引入新密钥（见文档：安全）。</translation>
    </message>
    <message>
        <source>The station {station} has no limits in this data folder. A supervisor&apos;s approval and a reason are needed, or limits for this station.</source>
        <translation>工位 {station} 在本数据文件夹中没有限值。需要主管批准并说明理由，或为该工位设置限值。</translation>
    </message>
    <message>
        <source>The suffix of {file} is no export format. Use one of {suffixes}.</source>
        <translation>{file} 的扩展名不是导出格式。请使用其中之一：{suffixes}。</translation>
    </message>
    <message>
        <source>The swing in {folder} cannot be read: {reason}. Check the read permission, or move the folder away.</source>
        <translation>{folder} 中的摆动无法读取：{reason}。请确认您有读取权限，或移走该文件夹。</translation>
    </message>
    <message>
        <source>The swing in {folder} changed after the tip was computed. Compute the tip again, then accept it.</source>
        <translation>{folder} 中的摆动在计算测头后有变化。请重新计算，然后接受。</translation>
    </message>
    <message>
        <source>The temperature of the pen was not measured; this station requires it. Measure it and enter it at Start, then repeat the swing.</source>
        <translation>光笔温度未测量，而本工位要求测量。请测量并在“开始”页输入，然后重新摆动。</translation>
    </message>
    <message>
        <source>The tip cannot be compared with the current one. {why}</source>
        <translation>测头无法与当前测头比较。{why}</translation>
    </message>
    <message>
        <source>The tip changed by {distance:.4f} mm since {date}, more than its limit ({limit:.4f} mm). Was the tip replaced, bent or refitted?</source>
        <translation>自 {date} 以来测头变化 {distance:.4f} mm，超出限值（{limit:.4f} mm）。测头是否更换、弯曲或重新安装过？</translation>
    </message>
    <message>
        <source>The tip changed by {distance:.4f} mm since {date}: along {axis} {difference:.4f} mm, more than the combined U ({uncertainty:.4f} mm). Was the tip replaced, bent or refitted?</source>
        <translation>自 {date} 以来测头变化 {distance:.4f} mm：沿 {axis} 为 {difference:.4f} mm，超出合成 U（{uncertainty:.4f} mm）。测头是否更换、弯曲或重新安装过？</translation>
    </message>
    <message>
        <source>The tip in {tip} was calibrated with the LED file {its_pen}, not {pen}. Give that LED file, or calibrate the tip with this one.</source>
        <translation>{tip} 中的测头是用 LED 文件 {its_pen} 标定的，而 {pen} 不是该文件：测头属于标定时所用的光笔和 LED 位置。请给出该文件，或用此文件标定测头。</translation>
    </message>
    <message>
        <source>The tip is computed after all recorded images are loaded.</source>
        <translation>载入全部录制图像后计算测头。</translation>
    </message>
    <message>
        <source>The tip is {distance:.1f} mm from its nominal centre. Check that the right tip is fitted.</source>
        <translation>测头与标称中心相差 {distance:.1f} mm。请检查所装测头是否正确。</translation>
    </message>
    <message>
        <source>The tip is {length:.0f} m from the pen origin. Check the unit of tx, ty and tz; millimetres are needed.</source>
        <translation>测头距光笔原点竟有 {length:.0f} m。长度需以毫米为单位：请检查 tx、ty、tz 的单位。</translation>
    </message>
    <message>
        <source>The tip is {tip:.0f} mm from the pen origin, farther than the pivot from the camera origin ({pivot:.0f} mm). This indicates inverted poses: for pen_from_cam, swap tip and pivot.</source>
        <translation>测头距光笔原点 {tip:.0f} mm，比支点距相机原点（{pivot:.0f} mm）更远。位姿求逆后正是如此：如果给出的是 pen_from_cam，则测头与支点应互换。</translation>
    </message>
    <message>
        <source>The tip is {x:+.4f} {y:+.4f} {z:+.4f} mm from its calibrated position, {distance:.4f} mm in all (U {uncertainty:.4f} mm, limit {limit:.4f} mm). Was the tip replaced, bent or refitted, or is it that of another pen?</source>
        <translation>测头偏离其标定位置 {x:+.4f} {y:+.4f} {z:+.4f} mm，总计 {distance:.4f} mm（U {uncertainty:.4f} mm，限值 {limit:.4f} mm）。测头是否被更换、弯曲或重新安装，或属于另一支光笔？</translation>
    </message>
    <message>
        <source>The tip library {file} was modified or damaged after it was saved. Restore the file from a copy.</source>
        <translation>测头库 {file} 在保存后被更改或损坏。请从副本恢复该文件。</translation>
    </message>
    <message>
        <source>The tip moved by {scatter:.2f} mm (RMS), {excess:.0f} times the image noise. Press the tip into the cone and repeat the swing; check that cone and camera are clamped and that the intrinsics file belongs to this camera, lens and focus.</source>
        <translation>测头移动了 {scatter:.2f} mm（均方根），为图像噪声的 {excess:.0f} 倍。请压紧测头，重新摆动；检查锥孔和相机是否固定，内参文件是否属于此相机、镜头和对焦。</translation>
    </message>
    <message>
        <source>The tip moved in its seat with the tilt by about {distance:.4f} mm; U includes this. Check tip and cone for form error, wear and dirt.</source>
        <translation>测头随倾斜在锥孔中移动约 {distance:.4f} mm，已计入 U。请检查测头和锥孔的形状误差、磨损和污物。</translation>
    </message>
    <message>
        <source>The tip rests {distance:.2f} mm from its previous position. Put it back into the cone; check that the cone is clamped.</source>
        <translation>测头偏离原位 {distance:.2f} mm。请放回锥孔，并检查锥孔是否夹紧。</translation>
    </message>
    <message>
        <source>The tip seating varied by {distance:.4f} mm (standard deviation) from image to image; U includes this. Clean tip and cone, check for wear, and press the tip in.</source>
        <translation>测头就位在各图像之间变化 {distance:.4f} mm（标准差），已计入 U。请清洁测头和锥孔，检查磨损，并压紧测头。</translation>
    </message>
    <message>
        <source>The tips from odd and even images differ by {difference:.4f} mm; usual is {usual:.4f} mm. The tip may have moved. Repeat the swing with the tip pressed in.</source>
        <translation>奇数与偶数图像求得的测头相差 {difference:.4f} mm，通常为 {usual:.4f} mm。测头可能移动过。请压紧测头，重新摆动。</translation>
    </message>
    <message>
        <source>The probed points of {name} come from both sides of the surface. Probe the feature again from one side.</source>
        <translation>{name} 的测点来自表面的两侧。请从一侧重新触测该要素。</translation>
    </message>
    <message>
        <source>LED positions and images disagree: {sigma:.1f} px; usual is {usual} px or less. {cause}</source>
        <translation>LED 位置与图像不符：{sigma:.1f} px；通常不超过 {usual} px。{cause}</translation>
    </message>
    <message>
        <source>LED positions and images disagree: {sigma:.2f} px; usual is {usual} px or less. The tip seems to move, too. {cause} Then check that the tip was pressed into the cone.</source>
        <translation>LED 位置与图像不符：{sigma:.2f} px；通常不超过 {usual} px。测头似乎也在移动。{cause}然后检查测头是否压在锥孔中。</translation>
    </message>
    <message>
        <source>LEDs {leds} are out of order. LEDs 1 to 4 must follow each other along the back line, and 5 to 7 and 8 to 10 along the columns in the same direction. Number them so.</source>
        <translation>LED {leds} 的顺序有误。LED 1 至 4 必须沿后排直线依次排列，5 至 7 和 8 至 10 须沿两列同向排列。请按此编号。</translation>
    </message>
    <message>
        <source>Line {line} of {name} is not valid JSON ({problem}, column {column}). Check that this is the right file, whole and in a form that the documents list under input files.</source>
        <translation>{name} 第 {line} 行不是有效的 JSON（{problem}，第 {column} 列）。请确认文件正确、完整，且格式为文档“输入文件”中所列的一种。</translation>
    </message>
    <message>
        <source>The LED layout does not define the pen frame, which needs ten LEDs, 1 to 4 in a line behind the plane of 5 to 10, and these in two columns of three parallel to the line, all within {tolerance:g} mm. Measure the LEDs again, or give the coordinates of another layout in its own frame.</source>
        <translation>LED 布局不能确定光笔坐标系：需要十个 LED，其中 1 至 4 在 5 至 10 所在平面之后成一直线，5 至 10 排成与该直线平行的两列、每列三个，均在 {tolerance:g} mm 以内。请重新测量 LED，或以自身坐标系给出其他布局的坐标。</translation>
    </message>
    <message>
        <source>The image shifts by {size:.3f} px (RMS) with the tilt of the pen. Either the camera turns as the operator moves, or a sideways push bends the stylus. The result is corrected and U includes the rest. Put the camera on a firm stand where steps do not move it, and let the weight of the pen press the tip.</source>
        <translation>图像随光笔倾斜平移 {size:.3f} px（均方根）。原因可能是相机随操作员移动而转动，或侧向推力使测针弯曲。结果已修正，其余部分计入 U。请将相机置于脚步不会影响的稳固支架上，并仅靠光笔自重压住测头。</translation>
    </message>
    <message>
        <source>The pose of camera {camera} in the rig file differs from the images by {angle:.1f}° and {distance:.0f} mm. Check that the file has cam_from_rig in millimetres (a point p of the first camera is at R p + t), that it matches the current camera positions, and that the images are in the order of its cameras; or calibrate the rig again.</source>
        <translation>相机 {camera} 在相机组文件中的位姿与图像相差 {angle:.1f}° 和 {distance:.0f} mm。请检查文件给出的是以毫米为单位的 cam_from_rig（第一台相机的点 p 位于 R p + t）、是否与当前相机位置一致，以及图像是否按文件中相机的顺序给出；或重新标定相机组。</translation>
    </message>
    <message>
        <source>The probed points of {name} do not show on which side of the surface the ball was. State &apos;side: inside&apos; or &apos;side: outside&apos; in the plan.</source>
        <translation>{name} 的测点不能表明测球位于表面的哪一侧。请在计划中写明 &apos;side: inside&apos; 或 &apos;side: outside&apos;。</translation>
    </message>
    <message>
        <source>The translations seem to be in metres: as millimetres they are only {typical:.3f} mm long (median). Multiply tx, ty and tz by 1000.</source>
        <translation>平移似乎以米为单位：若按毫米计，其长度只有 {typical:.3f} mm（中位数）。需要毫米：请将 tx、ty、tz 乘以 1000。</translation>
    </message>
    <message>
        <source>The two recordings have different numbers of images. Choose two simultaneous recordings.</source>
        <translation>两台相机的录像图像数量不同。请选择同时录制的两组录像。</translation>
    </message>
    <message>
        <source>The verification in {file} was modified or damaged after it was written. Restore the file from a copy.</source>
        <translation>{file} 中的验证在写入后被更改或损坏。请从副本恢复该文件。</translation>
    </message>
    <message>
        <source>The video {path} cannot be opened or contains no frames. Check that it plays, or save its frames as images.</source>
        <translation>视频 {path} 无法打开，或没有帧。请检查能否播放，或把各帧保存为图像。</translation>
    </message>
    <message>
        <source>The video {path} has the unsupported codec {codec}. Save it with FFV1 or MJPG, or save its frames as images.</source>
        <translation>视频 {path} 的编码为 {codec}，此处不支持。请以 FFV1 或 MJPG 编码保存，或将各帧另存为图像。</translation>
    </message>
    <message>
        <source>The views disagree on the pose of the second camera: {n_agree} of {n_pairs} agree. A camera was moved, or image pairs are not simultaneous. Check the names and order of the images.</source>
        <translation>各视图给出的第二台相机位姿不一致：{n_pairs} 组中有 {n_agree} 组一致。可能有相机移动过，或图像对不是同一时刻。请检查图像的名称和顺序。</translation>
    </message>
    <message>
        <source>The {kind} {id} expired on {due}. Send it for inspection.</source>
        <translation>{kind} {id} 已于 {due} 到期。请送检。</translation>
    </message>
    <message>
        <source>The {kind} {id} is in the library already, retired. Reactivate it, or choose another ID.</source>
        <translation>测头库中已有{kind} {id}，但已停用。请恢复使用，或为这一个另取编号。</translation>
    </message>
    <message>
        <source>The {kind} {id} is in the library already. Edit that item, or choose another ID.</source>
        <translation>测头库中已有{kind} {id}。请更改那一个，或为这一个另取编号。</translation>
    </message>
    <message>
        <source>The {kind} {id} was changed in another window after it was shown here. Nothing was saved. Read the present entries, then edit them again.</source>
        <translation>{kind} {id} 在此处显示后已在另一个窗口中更改。未保存任何内容。请查看当前条目，然后重新编辑。</translation>
    </message>
    <message>
        <source>The {what} of recorded images is fixed. Choose a live camera to change it.</source>
        <translation>录制图像的{what}无法更改。请选择实时相机。</translation>
    </message>
    <message>
        <source>The {what} {path} cannot be read: {reason}. Check the read permission and the disk connection.</source>
        <translation>{what} {path} 无法读取：{reason}。请检查您是否有读取权限，磁盘是否已连接。</translation>
    </message>
    <message>
        <source>The {what} {path} contains only blanks. Save it again.</source>
        <translation>{what} {path} 只有空白。请重新保存。</translation>
    </message>
    <message>
        <source>The {what} {path} has a name that is not valid for files. Check the name.</source>
        <translation>{what} {path} 的名称对文件无效。请检查名称。</translation>
    </message>
    <message>
        <source>The {what} {path} has {size:.1f} MB; the maximum is {limit:g} MB. Check that this is the right file.</source>
        <translation>{what} {path} 有 {size:.1f} MB，超过此类文件允许的 {limit:g} MB。请检查是否选对了文件。</translation>
    </message>
    <message>
        <source>The {what} {path} is a folder. Choose the file itself.</source>
        <translation>{what} {path} 是文件夹。请选择文件本身。</translation>
    </message>
    <message>
        <source>The {what} {path} is a pipe or a device. Choose a file on a disk.</source>
        <translation>{what} {path} 是管道或设备。请选择磁盘上的文件。</translation>
    </message>
    <message>
        <source>The {what} {path} is not text: byte {byte} matches no known encoding. Check that this is the right file, or save it as UTF-8.</source>
        <translation>{what} {path} 不是文本：第 {byte} 个字节不符合任何已知编码。请检查是否选对了文件，或另存为 UTF-8。</translation>
    </message>
    <message>
        <source>The {what} {path} is not text: line {line} contains the control character {character}. Check that this is the right file, or save it as UTF-8.</source>
        <translation>{what} {path} 不是文本：第 {line} 行含有控制字符 {character}。请检查是否选对了文件，或另存为 UTF-8。</translation>
    </message>
    <message>
        <source>There are {n_few} images of {few} and {n_many} of {many}, and their names, such as {example} and {other}, do not show which are simultaneous. Give simultaneous images the same name or number.</source>
        <translation>{few} 有 {n_few} 幅图像，{many} 有 {n_many} 幅，其名称（如 {example} 和 {other}）无法说明哪些是同时的。请给同时的图像相同的名称或编号。</translation>
    </message>
    <message>
        <source>There are {n_images} images; at least {needed} are needed, and 300 are usual. Record a swing of 15 seconds or more, 10 images a second or more.</source>
        <translation>现有 {n_images} 幅图像；至少需要 {needed} 幅，通常为 300 幅。请记录 15 秒或更长的摆动，每秒 10 幅或更多。</translation>
    </message>
    <message>
        <source>There is no LED {number}; {n_leds} LEDs are found, numbered from the tip upwards and from left to right. Give a length between two of these.</source>
        <translation>没有 LED {number}；找到 {n_leds} 个 LED，从测头向上、从左到右编号。请给出其中两个之间的长度。</translation>
    </message>
    <message>
        <source>This posture was recorded before. Keep the tip in the cone and change the pen tilt.</source>
        <translation>该姿态已记录过。请保持测头在锥孔中并改变光笔的倾斜。</translation>
    </message>
    <message>
        <source>This result needs checking. {why} Enter a reason to accept it.</source>
        <translation>该结果需检查。{why}请填写接受理由。</translation>
    </message>
    <message>
        <source>This result of tip {tip}, pen {pen}, is no longer current. Check the current result before you revoke the acceptance.</source>
        <translation>测头 {tip}（光笔 {pen}）的此结果已不是当前结果。撤销接受前请检查当前结果。</translation>
    </message>
    <message>
        <source>Tilt the pen to all sides by 20° or more, not only about its own axis.</source>
        <translation>请把光笔向各个方向倾斜 20° 以上，而不只是绕自身轴线转动。</translation>
    </message>
    <message>
        <source>Tilt the pen to the left and right as well as towards and away from the camera, and turn it about its own axis.</source>
        <translation>除了朝向和远离相机，请也向左右倾斜光笔，并绕自身轴线转动。</translation>
    </message>
    <message>
        <source>Tilt the pen towards and away from the camera as well as to the left and right, and turn it about its own axis.</source>
        <translation>除了左右，请也朝向和远离相机倾斜光笔，并绕自身轴线转动。</translation>
    </message>
    <message>
        <source>Tip error</source>
        <translation>测头误差</translation>
    </message>
    <message>
        <source>Tip {tip} is retired and cannot be accepted. Reactivate it in the tip library, or calibrate another tip.</source>
        <translation>测头 {tip} 已停用，无法接受。请在测头库中恢复使用，或标定其他测头。</translation>
    </message>
    <message>
        <source>Tip {tip} of pen {pen} has no accepted calibration. Calibrate it and accept the result; then it can be verified.</source>
        <translation>光笔 {pen} 的测头 {tip} 没有已接受的标定。请先标定并接受结果，然后才能验证。</translation>
    </message>
    <message>
        <source>To YOUR right, so that the program learns your position.</source>
        <translation>朝自己右侧，程序由此得知您的站位。</translation>
    </message>
    <message>
        <source>Tolerance</source>
        <translation>公差</translation>
    </message>
    <message>
        <source>Turn the LEDs towards the camera.</source>
        <translation>请将 LED 朝向相机。</translation>
    </message>
    <message>
        <source>Turn the LEDs towards the camera. No data is lost.</source>
        <translation>请将 LED 朝向相机。没有数据丢失。</translation>
    </message>
    <message>
        <source>U (k = 2) of the tip along its weakest direction is compared with the limit of {limit:.4f} mm by simple acceptance (ILAC-G8:09/2019, 4.2.1; JCGM 106:2012, 8.2): U itself is the quantity judged, so the guard band is zero. U up to the limit is PASS, above it CHECK, above {far:.4f} mm, {times:g} times the limit, REPEAT.</source>
        <translation>测头沿最弱方向的 U (k = 2) 按简单接受规则（ILAC-G8:09/2019，4.2.1；JCGM 106:2012，8.2）与限值 {limit:.4f} mm 比较：被判定的量就是 U 本身，因此保护带为零。U 不超过限值判为“合格”，超过判为“需检查”，超过 {far:.4f} mm（限值的 {times:g} 倍）判为“重新摆动”。</translation>
    </message>
    <message>
        <source>U (k = 2) of the tip is {uncertainty:.4f} mm in its weakest direction, limit {limit:.4f} mm. Capture more images in other postures.</source>
        <translation>测头在最弱方向上的 U (k = 2) 为 {uncertainty:.4f} mm，限值 {limit:.4f} mm。请以不同姿态继续采集。</translation>
    </message>
    <message>
        <source>U (k = 2) of the tip is {uncertainty:.4f} mm in its weakest direction, limit {limit:.4f} mm; {share:.4f} mm due to {advice}. More images hardly help.</source>
        <translation>测头在最弱方向上的 U (k = 2) 为 {uncertainty:.4f} mm，限值 {limit:.4f} mm。其中 {share:.4f} mm 来自{advice}。增加图像几乎没有帮助。</translation>
    </message>
    <message>
        <source>U (k = 2) of the tip is {uncertainty:.4f} mm in its weakest direction, limit {limit:.4f} mm; {share:.4f} mm is assumed for {advice}. More images hardly help.</source>
        <translation>测头在最弱方向上的 U (k = 2) 为 {uncertainty:.4f} mm，限值 {limit:.4f} mm。其中 {share:.4f} mm 为假定值，来自{advice}。增加图像几乎没有帮助。</translation>
    </message>
    <message>
        <source>U(size)</source>
        <translation>U（尺寸）</translation>
    </message>
    <message>
        <source>U(x y z)</source>
        <translation>U（x y z）</translation>
    </message>
    <message>
        <source>Verification complete. You can put the pen down.</source>
        <translation>验证完成。可以放下光笔。</translation>
    </message>
    <message>
        <source>Webcam (evaluation only)</source>
        <translation>网络摄像头（仅供试用）</translation>
    </message>
    <message>
        <source>With this LED file the lowest achievable U (k = 2) is {floor:.1f} µm; the limit is {limit:.1f} µm. Only the images needed for the postures are captured.</source>
        <translation>使用此 LED 文件可达到的最小 U (k = 2) 为 {floor:.1f} µm；限值为 {limit:.1f} µm。只采集各姿态所需的图像。</translation>
    </message>
    <message>
        <source>Without these images the tip is not determined; they remain included. {why}</source>
        <translation>剔除这些图像后无法确定测头，因此仍计入。{why}</translation>
    </message>
    <message>
        <source>Wrong supervisor password. Enter it again.</source>
        <translation>主管密码错误。请重新输入。</translation>
    </message>
    <message>
        <source>You can put the pen down.</source>
        <translation>可以放下光笔。</translation>
    </message>
    <message>
        <source>an ITK transform (.tfm) for 3D Slicer alone</source>
        <translation>仅用于 3D Slicer 的 ITK 变换 (.tfm)</translation>
    </message>
    <message>
        <source>an ITK transform (.tfm) that maps points from the tip to the pen</source>
        <translation>将点从测头坐标系映射到光笔坐标系的 ITK 变换 (.tfm)</translation>
    </message>
    <message>
        <source>angle</source>
        <translation>角度</translation>
    </message>
    <message>
        <source>approach</source>
        <translation>接近方向</translation>
    </message>
    <message>
        <source>calibration result</source>
        <translation>标定结果</translation>
    </message>
    <message>
        <source>camera</source>
        <translation>相机</translation>
    </message>
    <message>
        <source>camera calibration</source>
        <translation>相机标定</translation>
    </message>
    <message>
        <source>cameras in {name} is not a list of 2 to {most} cameras. A single camera needs no rig file.</source>
        <translation>{name} 中的 cameras 不是 2 至 {most} 台相机的列表。单台相机不需要相机组文件。</translation>
    </message>
    <message>
        <source>circle</source>
        <translation>圆</translation>
    </message>
    <message>
        <source>concentricity</source>
        <translation>同心度</translation>
    </message>
    <message>
        <source>cone angle</source>
        <translation>锥角</translation>
    </message>
    <message>
        <source>cylinder</source>
        <translation>圆柱</translation>
    </message>
    <message>
        <source>cylindricity</source>
        <translation>圆柱度</translation>
    </message>
    <message>
        <source>diameter</source>
        <translation>直径</translation>
    </message>
    <message>
        <source>distance</source>
        <translation>距离</translation>
    </message>
    <message>
        <source>entry {number} of chain {chain}</source>
        <translation>链 {chain} 的第 {number} 个条目</translation>
    </message>
    <message>
        <source>excluded manually</source>
        <translation>手动剔除</translation>
    </message>
    <message>
        <source>file of an unfinished verification</source>
        <translation>未完成验证的文件</translation>
    </message>
    <message>
        <source>flatness</source>
        <translation>平面度</translation>
    </message>
    <message>
        <source>form</source>
        <translation>形状</translation>
    </message>
    <message>
        <source>guard band (ISO 14253-1)</source>
        <translation>保护带（ISO 14253-1）</translation>
    </message>
    <message>
        <source>inside</source>
        <translation>内侧</translation>
    </message>
    <message>
        <source>length</source>
        <translation>长度</translation>
    </message>
    <message>
        <source>limits file</source>
        <translation>限值文件</translation>
    </message>
    <message>
        <source>line</source>
        <translation>直线</translation>
    </message>
    <message>
        <source>measuring plan</source>
        <translation>测量计划</translation>
    </message>
    <message>
        <source>no matching entry</source>
        <translation>无对应条目</translation>
    </message>
    <message>
        <source>not simultaneous</source>
        <translation>不是同一时刻</translation>
    </message>
    <message>
        <source>optional</source>
        <translation>可选</translation>
    </message>
    <message>
        <source>outside</source>
        <translation>外侧</translation>
    </message>
    <message>
        <source>parallelism</source>
        <translation>平行度</translation>
    </message>
    <message>
        <source>perpendicularity</source>
        <translation>垂直度</translation>
    </message>
    <message>
        <source>plane</source>
        <translation>平面</translation>
    </message>
    <message>
        <source>point</source>
        <translation>点</translation>
    </message>
    <message>
        <source>port out of range</source>
        <translation>端口超出范围</translation>
    </message>
    <message>
        <source>position</source>
        <translation>位置度</translation>
    </message>
    <message>
        <source>program error</source>
        <translation>程序错误</translation>
    </message>
    <message>
        <source>radius</source>
        <translation>半径</translation>
    </message>
    <message>
        <source>reference</source>
        <translation>标准器</translation>
    </message>
    <message>
        <source>required</source>
        <translation>必需</translation>
    </message>
    <message>
        <source>rotation of cam_from_rig about {axis}</source>
        <translation>cam_from_rig 绕 {axis} 的旋转</translation>
    </message>
    <message>
        <source>roundness</source>
        <translation>圆度</translation>
    </message>
    <message>
        <source>same as another image</source>
        <translation>与另一幅图像相同</translation>
    </message>
    <message>
        <source>simple acceptance (JCGM 106, 8.2)</source>
        <translation>简单接受（JCGM 106，8.2）</translation>
    </message>
    <message>
        <source>specific risk (JCGM 106, 8.3)</source>
        <translation>特定风险（JCGM 106，8.3）</translation>
    </message>
    <message>
        <source>sphere</source>
        <translation>球</translation>
    </message>
    <message>
        <source>not matching the pen</source>
        <translation>光点与光笔不匹配</translation>
    </message>
    <message>
        <source>station key</source>
        <translation>工位密钥</translation>
    </message>
    <message>
        <source>stylus</source>
        <translation>测杆</translation>
    </message>
    <message>
        <source>systematic errors common to all poses: the scale of the tracker and of the pen, a worn or badly seated tip</source>
        <translation>在所有位姿中保持不变的误差：跟踪仪和光笔的尺度、测头磨损或未就位</translation>
    </message>
    <message>
        <source>the CoordinateDefinitions for the device set of PLUS</source>
        <translation>用于 PLUS 设备集的 CoordinateDefinitions</translation>
    </message>
    <message>
        <source>the LED file. Measure the LEDs more accurately, and state their uncertainty</source>
        <translation>LED 文件。请更准确地测量 LED，并给出其不确定度</translation>
    </message>
    <message>
        <source>the extrinsics of the cameras. Calibrate the rig, and state the uncertainty</source>
        <translation>相机的外参。请标定相机组，并给出其不确定度</translation>
    </message>
    <message>
        <source>the form error of ball and cone. Use better ones, and state their form error</source>
        <translation>测球与锥孔的形状误差。请换用更好的，并给出其形状误差</translation>
    </message>
    <message>
        <source>the scatter of the poses and its correlation from pose to pose</source>
        <translation>位姿的散布，以及相邻位姿之间的相关性</translation>
    </message>
    <message>
        <source>tip library file</source>
        <translation>测头库文件</translation>
    </message>
    <message>
        <source>{cell} is too large.</source>
        <translation>{cell} 数值过大。</translation>
    </message>
    <message>
        <source>{count} is not valid. Enter 1 to {most} days or swings.</source>
        <translation>{count} 无效。请输入 1 至 {most} 天或次。</translation>
    </message>
    <message>
        <source>{file} is damaged: its verification cannot be continued. The images of its points stay where they are.</source>
        <translation>{file} 已损坏：无法继续它所属的验证。其测点图像保留在原处。</translation>
    </message>
    <message>
        <source>{folder} contains images of a swing, but no {name}. Restore this file from a copy, or move the folder away.</source>
        <translation>{folder} 中有摆动的图像，但没有 {name}。请用备份恢复该文件，或移走文件夹。</translation>
    </message>
    <message>
        <source>{journal} lists none of the {n_images} images in its folder. Restore this file from a copy.</source>
        <translation>{journal} 中没有其文件夹内 {n_images} 幅图像的任何一幅。请用备份恢复该文件。</translation>
    </message>
    <message>
        <source>{key} of {place} must contain the uncertainty of the rotation about x y z (rad) and of the translation (mm): 6 non-negative standard deviations, or a symmetric positive covariance matrix; up to 1 rad and 10 m. Correct or remove it.</source>
        <translation>{place}的 {key} 必须给出绕 x y z 的转角（rad）和平移（mm）的不确定度：6 个非负的标准差，或一个对称的正定协方差矩阵；最大为 1 rad 和 10 m。请更正或删除它。</translation>
    </message>
    <message>
        <source>{kind} ({by})</source>
        <translation>{kind}（{by}）</translation>
    </message>
    <message>
        <source>{kind}, {side} ({by})</source>
        <translation>{kind}，{side}（{by}）</translation>
    </message>
    <message>
        <source>{n_copies} of {n_images} images are copies of others and count once. Check the recording, and give each image once.</source>
        <translation>{n_images} 幅图像中有 {n_copies} 幅是其他图像的副本，只计一次。请检查记录，每幅图像只给出一次。</translation>
    </message>
    <message>
        <source>{n_dropped} of {n_images} images are excluded. Repeat the swing if the tip slipped.</source>
        <translation>{n_images} 幅图像中有 {n_dropped} 幅被剔除。若测头滑动过，请重新摆动。</translation>
    </message>
    <message>
        <source>{n_failed} of {n_trials} trials failed: the swing is too weak for simulation. Capture more images in other postures.</source>
        <translation>{n_trials} 次模拟中有 {n_failed} 次求不出测头：该摆动太差，无法用模拟重复。请以其他姿态采集更多图像。</translation>
    </message>
    <message>
        <source>{n_leds} LEDs are seen; at least {needed} are needed. Keep the whole pen in view, switch on all LEDs, and check exposure and focus.</source>
        <translation>看到 {n_leds} 个 LED；至少需要 {needed} 个。请使整支光笔在视野内，点亮所有 LED，并检查曝光和对焦。</translation>
    </message>
    <message>
        <source>{n_named} of {n_views} images are rotated by 180° ({names}). Rotate them back, or leave them out; the camera must not be turned during a calibration, and viewers must not rotate its images.</source>
        <translation>{n_views} 幅图像中有 {n_named} 幅旋转了 180°（{names}）。请转回或剔除；标定期间不得转动相机，看图软件也不得旋转其图像。</translation>
    </message>
    <message>
        <source>{n_points} points do not determine a {kind}; at least {needed} are needed. Probe more points.</source>
        <translation>{n_points} 个点不能确定{kind}；至少需要 {needed} 个。请触测更多点。</translation>
    </message>
    <message>
        <source>{name} describes a fisheye lens ({model}). The fisheye model of Kannala and Brandt (equidistant) is supported: calibrate the camera again with it.</source>
        <translation>{name} 描述的是鱼眼镜头（{model}）。支持 Kannala 和 Brandt 的鱼眼模型（等距）：请用该模型重新标定相机。</translation>
    </message>
    <message>
        <source>{name} has a lens field of the amplitude {amplitude:g} px and the correlation length {length:g} px; an amplitude above 0 and up to {largest:g} px, and a length from {shortest:g} px are needed. Correct or remove the entry lens_field.</source>
        <translation>{name} 的镜头残差场幅值为 {amplitude:g} px，相关长度为 {length:g} px；幅值须大于 0 且不超过 {largest:g} px，长度须不小于 {shortest:g} px。请更正或删除条目 lens_field。</translation>
    </message>
    <message>
        <source>{name} has a lens field of {columns:g} columns and {rows:g} rows; 2 to {most} of each are needed. Correct or remove the entry lens_field.</source>
        <translation>{name} 的镜头残差场有 {columns:g} 列、{rows:g} 行；行列各需 2 至 {most}。请更正或删除条目 lens_field。</translation>
    </message>
    <message>
        <source>{name} has rotations as three numbers, which may be angles in any order. Export the rotations as quaternions or matrices; name the columns of a rotation vector in radians rvec_x,rvec_y,rvec_z.</source>
        <translation>{name} 用三个数表示旋转，可能是任意顺序的角度。请将旋转导出为四元数或矩阵；若为以弧度表示的旋转向量，请将各列命名为 rvec_x,rvec_y,rvec_z。</translation>
    </message>
    <message>
        <source>{name} has the distortion model {model}, which is not supported. Calibrate the camera again with plumb_bob (radtan), rational_polynomial or equidistant.</source>
        <translation>{name} 的畸变模型 {model} 不受支持。请用 plumb_bob (radtan)、rational_polynomial 或 equidistant 重新标定相机。</translation>
    </message>
    <message>
        <source>{name} has two cameras named {camera}. Give each camera a unique name.</source>
        <translation>{name} 中有两台相机都名为 {camera}。请为每台相机取不同的名称。</translation>
    </message>
    <message>
        <source>{name} has {counted}; the fisheye model needs 4 (k1 k2 k3 k4). Export the file again.</source>
        <translation>{name} 有 {counted}；鱼眼模型需要 4 个（k1 k2 k3 k4）。请重新导出该文件。</translation>
    </message>
    <message>
        <source>{name} is JSON, where a table is read. Write it as CSV, with a header and a line for each row.</source>
        <translation>{name} 是 JSON，而此处读取的是表格。请写成 CSV，带表头，每行一条。</translation>
    </message>
    <message>
        <source>{name} is no workbook with a sheet that can be read. Save the sheet with the table as CSV.</source>
        <translation>{name} 不是含可读工作表的工作簿。请将含表格的工作表另存为 CSV。</translation>
    </message>
    <message>
        <source>{name} is not valid TOML ({problem}). Check that this is the right file, whole and in a form that the documents list under input files.</source>
        <translation>{name} 不是有效的 TOML（{problem}）。请确认文件正确、完整，且格式为文档“输入文件”中所列的一种。</translation>
    </message>
    <message>
        <source>{name} is not valid YAML. Check that this is the right file.</source>
        <translation>{name} 不是有效的 YAML。请检查是否选对了文件。</translation>
    </message>
    <message>
        <source>{name} unpacks to more than 50 MB. Save the sheet with the table as CSV.</source>
        <translation>{name} 解压后超过 50 MB。请将含表格的工作表另存为 CSV。</translation>
    </message>
    <message>
        <source>{one} and {other} hold the same tip to the last digit. Give each calibration once.</source>
        <translation>{one} 与 {other} 的测头完全相同。每次标定只需给出一次。</translation>
    </message>
    <message>
        <source>{other} was calibrated with another intrinsics file than {first}. Give two swings with one intrinsics file.</source>
        <translation>{other} 与 {first} 标定时所用的内参文件不同。请给出使用同一内参文件的两次摆动。</translation>
    </message>
    <message>
        <source>{path} is the name of a device on Windows, not of a file. Choose another name.</source>
        <translation>{path} 是 Windows 上的设备名，而不是文件名。请选择其他名称。</translation>
    </message>
    <message>
        <source>{percent:.0f} % of the LED centres do not fit and are rejected, {where}. Look for reflections, fingers and dirt there, then repeat the swing.</source>
        <translation>{percent:.0f} % 的 LED 中心不符而被剔除，{where}。请检查该处的反光、手指和污物，然后重新摆动。</translation>
    </message>
    <message>
        <source>{percent:.0f} % of the centres of LED {led} do not fit and are rejected. Look for reflections, dirt and damage there, and check its coordinates in the LED file.</source>
        <translation>LED {led} 有 {percent:.0f} % 的中心不符而被剔除。请检查该处的反光、污物和损坏，并核对 LED 文件中的坐标。</translation>
    </message>
    <message>
        <source>{place} has {count} numbers; three coordinates are needed, with three more for the normal, the same for all LEDs. Correct it.</source>
        <translation>{place} 有 {count} 个数；需要三个坐标，法向另需三个，所有 LED 须相同。请更正。</translation>
    </message>
    <message>
        <source>{quantity} {of}</source>
        <translation>{of} 的{quantity}</translation>
    </message>
    <message>
        <source>{reason} The data folder {folder} is not writable.</source>
        <translation>{reason}数据文件夹 {folder} 不可写。</translation>
    </message>
    <message>
        <source>{reason} The folder {folder} cannot be created or read.</source>
        <translation>{reason}无法创建或读取文件夹 {folder}。</translation>
    </message>
    <message>
        <source>{reason} {path} cannot be written. The images recorded so far are safe.</source>
        <translation>{reason}无法写入 {path}。已记录的图像是安全的。</translation>
    </message>
    <message>
        <source>{reason} {path} cannot be written. The previous content is unchanged.</source>
        <translation>{reason}无法写入 {path}。原有内容未改变。</translation>
    </message>
    <message>
        <source>{reason} {power}</source>
        <translation>{reason} {power}</translation>
    </message>
    <message>
        <source>{time} early</source>
        <translation>提前 {time}</translation>
    </message>
    <message>
        <source>{time} late</source>
        <translation>滞后 {time}</translation>
    </message>
    <message>
        <source>{unit} is not a supported unit of length. Choose one of {known}.</source>
        <translation>{unit} 不是本程序支持的长度单位。请从 {known} 中选择。</translation>
    </message>
    <message>
        <source>{usable} (excluded: {left_out})</source>
        <translation>{usable}（剔除：{left_out}）</translation>
    </message>
    <message>
        <source>{value:.3g} image intervals</source>
        <translation>{value:.3g} 个图像间隔</translation>
    </message>
    <message>
        <source>{value:.3g} ms</source>
        <translation>{value:.3g} ms</translation>
    </message>
    <message>
        <source>{value:.3g} s</source>
        <translation>{value:.3g} s</translation>
    </message>
    <message>
        <source>{value:.3g} µs</source>
        <translation>{value:.3g} µs</translation>
    </message>
    <message>
        <source>{name} names the intrinsics file of {camera}: {fault}</source>
        <translation>{name} 所指定的相机 {camera} 的文件：{fault}</translation>
    </message>
    <message>
        <source>{name}: {flaw}</source>
        <translation>{name}：{flaw}</translation>
    </message>
    <message>
        <source>{path} does not contain all input data of the calibration. Calibrate from the images.</source>
        <translation>{path} 未包含计算测头所用的全部数据。请用图像标定。</translation>
    </message>
    <message>
        <source>{path} is damaged. Restore it from a copy.</source>
        <translation>{path} 已损坏。请用备份恢复。</translation>
    </message>
    <message>
        <source>{path} was written by a later version of the program (format {number}; this version reads up to {known}). Open the record with that version.</source>
        <translation>{path} 由更新版本的程序写入（格式 {number}；本版本最高读取 {known}）。请用该版本打开此记录。</translation>
    </message>
    <message>
        <source>{run} has {n_touches} usable points; a length needs both its ends. Probe each end at least once.</source>
        <translation>{run} 有 {n_touches} 个可用的测点；长度需要两端。请对每一端至少触测一次。</translation>
    </message>
    <message>
        <source>{run}: the pen was not held still for {n_all} images on any point ({n_settling} to settle, {n_frames} that count). Hold it still longer, use fewer images per point, or use each image as a point.</source>
        <translation>{run}：光笔在任何点上都未静止满 {n_all} 幅图像（{n_settling} 幅用于稳定，{n_frames} 幅计入）。请保持静止更久、减少每点图像数，或将每幅图像作为一个点。</translation>
    </message>
    <message>
        <source>{text} is not a board. Use a form such as {forms}; lengths are in mm.</source>
        <translation>{text} 不是标定板。请按如下形式命名：{forms}；长度单位为 mm。</translation>
    </message>
    <message>
        <source>{reason}. Choose another folder or name.</source>
        <translation>{reason}。请选择其他文件夹或名称。</translation>
    </message>
    <message>
        <source>The LEDs cannot be tracked: no {needed} successive images of {n_images} show the same 5 LEDs. Give the images in the order of capture, 10 or more a second, with the whole pen in view.</source>
        <translation>无法跟踪 LED：{n_images} 幅图像中没有连续 {needed} 幅显示相同的 5 个 LED。请按采集顺序给出图像，每秒 10 幅以上，且整支光笔在视场内。</translation>
    </message>
    <message>
        <source>The LEDs span {extent:.6g} m; a pen spans at most {most:g} m. Check that the coordinates are in millimetres, also in the header, or state their unit.</source>
        <translation>LED 的跨度为 {extent:.6g} m；光笔最多 {most:g} m。请检查坐标是否以毫米为单位（表头也是），或注明其单位。</translation>
    </message>
    <message>
        <source>The adjustment did not converge in {n_steps} iterations: the views are too similar, or the board is another one, or far from flat. Add views with the board tilted by 20° to 40° to each side and in each corner of the image; otherwise count and measure the squares again.</source>
        <translation>平差在 {n_steps} 次迭代内未收敛：视图过于相似，或标定板不是所述的，或远非平面。请增加标定板向各侧倾斜 20° 至 40° 及位于图像各角的视图；否则请重新数并测量方格。</translation>
    </message>
    <message>
        <source>The database {name} is empty. Its administrator must set it up as described in docs/archive.md.</source>
        <translation>数据库 {name} 为空。管理员须按 docs/archive.md 所述进行设置。</translation>
    </message>
    <message>
        <source>The drift reference moved by {distance:.4f} mm between {first} and {visit} (U {uncertainty:.4f} mm, limit {limit:.4f} mm): the camera or the cone is not clamped, or the camera had not warmed up. Points measured in between have an error of this size.</source>
        <translation>漂移参考点在 {first} 与 {visit} 之间移动了 {distance:.4f} mm（U {uncertainty:.4f} mm，限值 {limit:.4f} mm）：相机或锥孔未夹紧，或相机未预热。其间测量的点有同样大小的误差。</translation>
    </message>
    <message>
        <source>The key of the station with chain {chain} is not in this user account; nothing can be signed. Use the account and computer of the station, copy the key here, or let a supervisor introduce another (documents: security).</source>
        <translation>链 {chain} 所属工位的密钥不在此用户账户中；无法签名。请使用该工位的账户和计算机、将密钥复制到此处，或由主管引入新密钥（见文档：security）。</translation>
    </message>
    <message>
        <source>The length is between LED {number} and itself. Give the numbers of two LEDs.</source>
        <translation>长度两端都是 LED {number}。请给出两个 LED 的编号。</translation>
    </message>
    <message>
        <source>The length limits U: a standard uncertainty of {sigma:.3f} mm would reduce U from {now:.0f} to {then:.0f} µm.</source>
        <translation>长度限制了 U：标准不确定度为 {sigma:.3f} mm 时，U 将从 {now:.0f} 降至 {then:.0f} µm。</translation>
    </message>
    <message>
        <source>The length of {length:g} mm does not fit LEDs {first} and {second}: it gives a disc diameter of {found:.2f} mm, stated is {stated:g} mm. It may be the length between LEDs {other} and {another}. Check which LEDs were measured, and the diameter of the discs.</source>
        <translation>长度 {length:g} mm 与 LED {first} 和 {second} 不符：由此得圆盘直径 {found:.2f} mm，给定为 {stated:g} mm。它可能是 LED {other} 与 {another} 之间的长度。请检查测量的是哪些 LED 以及圆盘直径。</translation>
    </message>
    <message>
        <source>The lengths contradict each other: LEDs {first} and {second} are stated {stated:.3f} mm apart; the other lengths give {implied:.3f} mm. Check the numbers of the LEDs, and measure again.</source>
        <translation>各长度互相矛盾：LED {first} 与 {second} 给定相距 {stated:.3f} mm；由其他长度得 {implied:.3f} mm。请检查 LED 编号并重新测量。</translation>
    </message>
    <message>
        <source>The lens deviates by {size:.3f} px (RMS) from its distortion model; the result is corrected and U includes the rest. Calibrate the camera with views that fill the image; its file then states the lens field.</source>
        <translation>镜头偏离畸变模型 {size:.3f} px（均方根）；结果已修正，其余计入 U。请用充满图像的视图标定相机；其文件随后会给出镜头残差场。</translation>
    </message>
    <message>
        <source>The pen tilt differs from that of the first visit, so this point does not count. Hold the pen as at the first visit, so that systematic errors of the pen cancel.</source>
        <translation>光笔倾斜与首次触测时不同，因此此点不计入。请按首次的姿态握持光笔，使光笔的系统误差抵消。</translation>
    </message>
    <message>
        <source>The points are {rms:.2f} px from those of a flat board {board}: its squares differ from the description, it is bent, or the images are not from one camera with one focus. Count and measure its squares again.</source>
        <translation>各点与平面标定板 {board} 的点相差 {rms:.2f} px：方格与描述不符、标定板弯曲，或图像并非来自同一相机同一对焦。请重新数并测量方格。</translation>
    </message>
    <message>
        <source>{name} is a list; an LED file is a mapping with leds and units. Correct the file.</source>
        <translation>{name} 是列表；LED 文件应为含 leds 和 units 的映射。请改正文件。</translation>
    </message>
    <message>
        <source>{name} is a table and cannot store name, nominal tip and covariance of the pen. Choose a name that ends in .json.</source>
        <translation>{name} 是表格，无处存放光笔的名称、标称测头和协方差。请选择以 .json 结尾的文件名。</translation>
    </message>
    <message>
        <source>{name} is for {n_cameras} cameras, but {n_files} intrinsics files are with it. Restore it from a copy.</source>
        <translation>{name} 对应 {n_cameras} 台相机，而与之相配的内参文件有 {n_files} 个。请从备份恢复该文件。</translation>
    </message>
    <message>
        <source>{name} is {width} x {height} px and needs {needed:.0f} MB for decoding; the maximum is {most:.0f} MB. Save the images as grey PNG.</source>
        <translation>{name} 为 {width} × {height} px，解码需要 {needed:.0f} MB；每幅图像最多可用 {most:.0f} MB。请将图像保存为灰度 PNG。</translation>
    </message>
    <message>
        <source>{name} is {width} x {height} px; the maximum is {most:,} px. Choose images of the calibrated camera.</source>
        <translation>{name} 为 {width} × {height} px；最多读取 {most:,} px，已超过一般相机的像素数。请选择已标定相机的图像。</translation>
    </message>
    <message>
        <source>{name} states its lengths in {stated}, but the unit {given} is given. Omit the unit, or correct the file.</source>
        <translation>{name} 注明的长度单位是 {stated}，但给出的单位是 {given}。请不要另给单位，或改正文件。</translation>
    </message>
    <message>
        <source>{name} states the uncertainty of the pose of {one}, but not of {other}. State it for all cameras but the first, or for none.</source>
        <translation>{name} 给出了 {one} 位置的不确定度，却没有给出 {other} 的。请为除第一台外的所有相机给出，或全部不给。</translation>
    </message>
    <message>
        <source>{name} was modified after recording (wrong checksum). Restore it from a copy.</source>
        <translation>{name} 与记录时不同（校验和错误）。请用备份恢复。</translation>
    </message>
    <message>
        <source>Files that were used to calibrate the tip cannot verify it: {n} of these. Probe the artefact anew.</source>
        <translation>这些文件中有 {n} 个是标定该测头时所用的，不能用来验证它。请重新测量标准器。</translation>
    </message>
    <message>
        <source>{path} cannot be written: it is a folder. Choose a file name.</source>
        <translation>无法写入 {path}：它是文件夹。请指定文件。</translation>
    </message>
    <message>
        <source>{path} has several cameras; only calibrations of a single camera can be recomputed. Remove it.</source>
        <translation>{path} 来自多台相机；只能重新求解单台相机的标定。请将其去掉。</translation>
    </message>
    <message>
        <source>{path} is neither a recorded swing nor a result. Open a swing folder, a file in it, or a file in the folder results.</source>
        <translation>{path} 既不是摆动记录，也不是标定结果。请打开摆动记录的文件夹、其中的文件，或 results 文件夹中的文件。</translation>
    </message>
    <message>
        <source>{path} is not a calibration record. Give a file written by the command calibrate, or an accepted result.</source>
        <translation>{path} 不是标定记录。请给出 calibrate 命令写出的文件，或已接受的结果。</translation>
    </message>
    <message>
        <source>{path} was modified after recording (wrong checksum). Restore it from a copy.</source>
        <translation>{path} 与记录时不同（校验和错误）。请用备份恢复。</translation>
    </message>
    <message>
        <source>{place} contains no images of two cameras. Give a folder that contains one folder per camera, named as in the rig file: {names}.</source>
        <translation>{place} 中没有两台相机的图像。请指定一个文件夹，其中每台相机各有一个文件夹，名称与相机组文件中的相同：{names}。</translation>
    </message>
    <message>
        <source>{place} contains no images. Choose a recording with images.</source>
        <translation>{place} 中没有图像。请选择有图像的录制。</translation>
    </message>
    <message>
        <source>{place} contains the images of {n_given} cameras; the verification uses {n_cameras}. Give the intrinsics file or the rig file of these images.</source>
        <translation>{place} 中有 {n_given} 台相机的图像，而验证测头用的是 {n_cameras} 台。请指定这些图像的内参文件或相机组文件。</translation>
    </message>
    <message>
        <source>{place} has no {key}, or its value is not text. Add it.</source>
        <translation>{place}没有 {key}，或者它不是文本。请补上。</translation>
    </message>
    <message>
        <source>{place} is not a mapping with name, intrinsics and cam_from_rig.</source>
        <translation>{place}不是包含 name、intrinsics 和 cam_from_rig 的映射。</translation>
    </message>
    <message>
        <source>{place} is not a mapping. Write it as {{&quot;led&quot;: 1, &quot;x&quot;: 0, &quot;y&quot;: 0, &quot;z&quot;: -30}}.</source>
        <translation>{place} 不是映射。请写成 {{&quot;led&quot;: 1, &quot;x&quot;: 0, &quot;y&quot;: 0, &quot;z&quot;: -30}}。</translation>
    </message>
    <message>
        <source>{place} is the reference of the rig; its pose is exact. Remove its {key}.</source>
        <translation>{place}是相机组的基准，其位置没有不确定度。请删除它的 {key}。</translation>
    </message>
    <message>
        <source>{place}: the normal {normal} does not have the length 1. Correct it, or omit the normals if all discs face +z.</source>
        <translation>{place}：法向量 {normal} 的长度不为 1。请更正；若所有圆盘都朝 +z，可省略法向量。</translation>
    </message>
    <message>
        <source>{run}: LED positions and images disagree: {rms:.1f} px; usual is {usual} px or less. Check that the images show this pen with this camera.</source>
        <translation>{run}：LED 位置与图像不符：{rms:.1f} px，通常不超过 {usual} px。请检查图像是否属于这支光笔和这台相机。</translation>
    </message>
    <message>
        <source>{run}: none of the {n_images} images shows the pen ({why}). {advice}</source>
        <translation>{run}：{n_images} 幅图像均未显示光笔（{why}）。{advice}</translation>
    </message>
    <message>
        <source>{told} Their size is that of {other}. Give the images in the order of the cameras in the rig file.</source>
        <translation>{told} 其尺寸与 {other} 的相同。请按相机组文件中的相机顺序给出图像。</translation>
    </message>
    <message>
        <source>{usable}; the tip needs at least {needed}. {advice}</source>
        <translation>{usable}；求测头至少需要 {needed} 幅。{advice}</translation>
    </message>
    <message>
        <source>{what} {wanted:.6g} ± {wanted_u:.2g}{unit} from the images, {stated:.6g} ± {stated_u:.2g}{unit} in the file (k = 2)</source>
        <translation>{what}由图像为 {wanted:.6g} ± {wanted_u:.2g}{unit}，文件中为 {stated:.6g} ± {stated_u:.2g}{unit} (k = 2)</translation>
    </message>
    <message>
        <source>{why}</source>
        <translation>{why}</translation>
    </message>
    <message>
        <source>{width} x {height} px</source>
        <translation>{width} × {height} px</translation>
    </message>
</context>
<context>
    <name>history</name>
    <message>
        <source>Calibration</source>
        <translation>标定</translation>
    </message>
    <message>
        <source>Rejected</source>
        <translation>已拒绝</translation>
    </message>
    <message>
        <source>Abandoned</source>
        <translation>已放弃</translation>
    </message>
    <message>
        <source>Revocation</source>
        <translation>撤销</translation>
    </message>
    <message>
        <source>Comment</source>
        <translation>备注</translation>
    </message>
    <message>
        <source>Tip library</source>
        <translation>测头库</translation>
    </message>
    <message>
        <source>Verification</source>
        <translation>验证</translation>
    </message>
    <message>
        <source>Camera calibration</source>
        <translation>相机标定</translation>
    </message>
    <message>
        <source>Limits</source>
        <translation>限值</translation>
    </message>
    <message>
        <source>Repeated</source>
        <translation>已重复</translation>
    </message>
    <message>
        <source>accepted</source>
        <translation>已接受</translation>
    </message>
    <message>
        <source>rejected</source>
        <translation>已拒绝</translation>
    </message>
    <message>
        <source>current</source>
        <translation>当前</translation>
    </message>
    <message>
        <source>revoked</source>
        <translation>已撤销</translation>
    </message>
    <message>
        <source>expiry date {0}</source>
        <translation>有效期至 {0}</translation>
    </message>
    <message>
        <source>bending and U {0} mm</source>
        <translation>弯曲及 U {0} mm</translation>
    </message>
    <message>
        <source>max. change {0} mm</source>
        <translation>最大变化 {0} mm</translation>
    </message>
    <message>
        <source>calibration interval {0} days</source>
        <translation>标定周期 {0} 天</translation>
    </message>
    <message>
        <source>camera {0}</source>
        <translation>相机 {0}</translation>
    </message>
    <message>
        <source>supervisor password changed</source>
        <translation>主管密码已更改</translation>
    </message>
    <message>
        <source>station key changed</source>
        <translation>工位密钥已更改</translation>
    </message>
    <message>
        <source>Modified after entry</source>
        <translation>录入后被更改</translation>
    </message>
    <message>
        <source>saved</source>
        <translation>已保存</translation>
    </message>
    <message>
        <source>abandoned</source>
        <translation>已放弃</translation>
    </message>
    <message>
        <source>replaced</source>
        <translation>已被取代</translation>
    </message>
    <message>
        <source>ball {0} mm</source>
        <translation>测球 {0} mm</translation>
    </message>
    <message>
        <source>nominal centre {0} mm</source>
        <translation>标称中心 {0} mm</translation>
    </message>
    <message>
        <source>signed by {0}</source>
        <translation>由 {0} 签署</translation>
    </message>
    <message>
        <source>retired</source>
        <translation>已停用</translation>
    </message>
</context>
<context>
    <name>language</name>
    <message>
        <source>English</source>
        <translation>简体中文</translation>
    </message>
</context>
<context>
    <name>opened_folder</name>
    <message>
        <source>No file manager found. Folder: {0}</source>
        <translation>没有文件管理器。文件夹：{0}</translation>
    </message>
</context>
<context>
    <name>paper</name>
    <message>
        <source>U (k = 2) by source, weakest direction / mm</source>
        <translation>各来源的 U (k = 2)，最弱方向 / mm</translation>
    </message>
    <message>
        <source>Page {0} of {1}</source>
        <translation>第 {0} 页，共 {1} 页</translation>
    </message>
    <message>
        <source>Pen {0}, tip {1}, cone {2}</source>
        <translation>光笔 {0}，测头 {1}，锥孔 {2}</translation>
    </message>
    <message>
        <source>SHA-256 of the JSON file: {0}</source>
        <translation>JSON 文件的 SHA-256：{0}</translation>
    </message>
    <message>
        <source>No. {0}</source>
        <translation>编号 {0}</translation>
    </message>
    <message>
        <source>NOT ACCEPTED</source>
        <translation>未接受</translation>
    </message>
    <message>
        <source>The tip was accepted.</source>
        <translation>该测头已被接受。</translation>
    </message>
    <message>
        <source>Calibration report</source>
        <translation>标定报告</translation>
    </message>
    <message>
        <source>This tip has not been accepted.</source>
        <translation>该测头未被接受。</translation>
    </message>
    <message>
        <source>The tip was accepted. Reason: {0}</source>
        <translation>该测头已被接受。理由：{0}</translation>
    </message>
    <message>
        <source>no</source>
        <translation>未接受</translation>
    </message>
    <message>
        <source>Practice: not used for any pen.</source>
        <translation>练习：不用于任何光笔。</translation>
    </message>
    <message>
        <source>practice</source>
        <translation>练习</translation>
    </message>
    <message>
        <source>RETIRED</source>
        <translation>已停用</translation>
    </message>
    <message>
        <source>OVERDUE</source>
        <translation>已过期</translation>
    </message>
    <message>
        <source>valid</source>
        <translation>有效</translation>
    </message>
    <message>
        <source>assumed</source>
        <translation>假定</translation>
    </message>
    <message>
        <source>Camera</source>
        <translation>相机</translation>
    </message>
    <message>
        <source>Pen</source>
        <translation>光笔</translation>
    </message>
    <message>
        <source>Calibrated by</source>
        <translation>标定人</translation>
    </message>
    <message>
        <source>not stated</source>
        <translation>未注明</translation>
    </message>
    <message>
        <source>Verification report</source>
        <translation>验证报告</translation>
    </message>
    <message>
        <source>Verified by</source>
        <translation>验证人</translation>
    </message>
    <message>
        <source>Measurement report</source>
        <translation>测量报告</translation>
    </message>
    <message>
        <source>Measured by</source>
        <translation>测量人</translation>
    </message>
    <message>
        <source>Pen {0}, tip {1}, {2}</source>
        <translation>光笔 {0}，测头 {1}，{2}</translation>
    </message>
    <message>
        <source>yes</source>
        <translation>是</translation>
    </message>
</context>
<context>
    <name>phrases</name>
    <message>
        <source>Seat the tip</source>
        <translation>测头就位</translation>
    </message>
    <message>
        <source>Seat and swing</source>
        <translation>就位并摆动</translation>
    </message>
    <message>
        <source>Seated</source>
        <translation>已就位</translation>
    </message>
    <message>
        <source>Tilt right</source>
        <translation>向右倾斜</translation>
    </message>
    <message>
        <source>Away and right</source>
        <translation>向右前方倾斜</translation>
    </message>
    <message>
        <source>Tilt away</source>
        <translation>向前倾斜</translation>
    </message>
    <message>
        <source>Away and left</source>
        <translation>向左前方倾斜</translation>
    </message>
    <message>
        <source>Tilt left</source>
        <translation>向左倾斜</translation>
    </message>
    <message>
        <source>Towards you and left</source>
        <translation>向左后方倾斜</translation>
    </message>
    <message>
        <source>Tilt towards you</source>
        <translation>向后倾斜</translation>
    </message>
    <message>
        <source>Towards you and right</source>
        <translation>向右后方倾斜</translation>
    </message>
    <message>
        <source>Keep the tip pressed into the cone.</source>
        <translation>保持测头压紧在锥孔中。</translation>
    </message>
    <message>
        <source>Follow the arrow</source>
        <translation>跟随箭头</translation>
    </message>
    <message>
        <source>Show the LEDs</source>
        <translation>露出 LED</translation>
    </message>
    <message>
        <source>Slower</source>
        <translation>慢一点</translation>
    </message>
    <message>
        <source>LEDs do not fit</source>
        <translation>LED 不匹配</translation>
    </message>
    <message>
        <source>Tip slipped</source>
        <translation>测头滑动</translation>
    </message>
    <message>
        <source>Paused</source>
        <translation>已暂停</translation>
    </message>
    <message>
        <source>Tip not in place</source>
        <translation>测头不在原位</translation>
    </message>
    <message>
        <source>Starts in {seconds}</source>
        <translation>{seconds} 秒后开始</translation>
    </message>
    <message>
        <source>More images</source>
        <translation>继续采集</translation>
    </message>
    <message>
        <source>Hold it upright</source>
        <translation>竖直握住</translation>
    </message>
    <message>
        <source>Capture ended</source>
        <translation>采集结束</translation>
    </message>
    <message>
        <source>File does not fit</source>
        <translation>文件不符</translation>
    </message>
    <message>
        <source>Camera or cone moved</source>
        <translation>相机或锥孔移动</translation>
    </message>
    <message>
        <source>Tip has changed</source>
        <translation>测头有变化</translation>
    </message>
    <message>
        <source>No tip found</source>
        <translation>未求得测头</translation>
    </message>
    <message>
        <source>noise</source>
        <translation>噪声</translation>
    </message>
    <message>
        <source>drift</source>
        <translation>漂移</translation>
    </message>
    <message>
        <source>LEDs</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>camera</source>
        <translation>相机</translation>
    </message>
    <message>
        <source>rig</source>
        <translation>相机组</translation>
    </message>
    <message>
        <source>Enter the name of the station.</source>
        <translation>请填写工位名称。</translation>
    </message>
    <message>
        <source>Enter the name of the operator.</source>
        <translation>请填写操作员姓名。</translation>
    </message>
    <message>
        <source>Enter the serial number of the pen.</source>
        <translation>请填写光笔序列号。</translation>
    </message>
    <message>
        <source>Enter the name of the probe tip.</source>
        <translation>请填写测头名称。</translation>
    </message>
    <message>
        <source>Enter the name of the cone.</source>
        <translation>请填写锥孔名称。</translation>
    </message>
    <message>
        <source>Choose the folder of the recorded images.</source>
        <translation>请选择录制图像的文件夹。</translation>
    </message>
    <message>
        <source>Search for the camera and choose it.</source>
        <translation>请搜索并选择相机。</translation>
    </message>
    <message>
        <source>Open the intrinsics file.</source>
        <translation>请打开内参文件。</translation>
    </message>
    <message>
        <source>Choose the second camera.</source>
        <translation>选择第二台相机。</translation>
    </message>
    <message>
        <source>Open the rig file of both cameras.</source>
        <translation>打开两台相机的相机组文件。</translation>
    </message>
    <message>
        <source>Hold the pen in view</source>
        <translation>让相机看到光笔</translation>
    </message>
    <message>
        <source>Tilt RIGHT</source>
        <translation>朝自己右侧倾斜</translation>
    </message>
    <message>
        <source>Pen not detected</source>
        <translation>看不到光笔</translation>
    </message>
    <message>
        <source>Loading</source>
        <translation>载入中</translation>
    </message>
    <message>
        <source>Tilt further</source>
        <translation>增大倾斜</translation>
    </message>
    <message>
        <source>Not determined yet</source>
        <translation>尚未确定</translation>
    </message>
    <message>
        <source>Uncertainty too large</source>
        <translation>不确定度过大</translation>
    </message>
    <message>
        <source>Odd and even differ</source>
        <translation>奇偶结果不一致</translation>
    </message>
    <message>
        <source>Many images rejected</source>
        <translation>舍去图像过多</translation>
    </message>
    <message>
        <source>Many images excluded</source>
        <translation>剔除的图像过多</translation>
    </message>
    <message>
        <source>LED displaced</source>
        <translation>LED 移位</translation>
    </message>
    <message>
        <source>Temperature not measured</source>
        <translation>温度未测量</translation>
    </message>
    <message>
        <source>Cameras not synchronised</source>
        <translation>相机不同步</translation>
    </message>
    <message>
        <source>Uncertainty of files too large</source>
        <translation>文件不确定度过大</translation>
    </message>
    <message>
        <source>No comparison possible</source>
        <translation>无法比较</translation>
    </message>
    <message>
        <source>Moved during the swing</source>
        <translation>摆动中移动</translation>
    </message>
    <message>
        <source>Two-stage tip uncertain</source>
        <translation>两步法测头不确定</translation>
    </message>
    <message>
        <source>Within limits</source>
        <translation>在限值内</translation>
    </message>
    <message>
        <source>Many LED centres rejected</source>
        <translation>许多 LED 中心被剔除</translation>
    </message>
    <message>
        <source>Press Space to continue.</source>
        <translation>按空格键继续。</translation>
    </message>
    <message>
        <source>{0} See the list in Review.</source>
        <translation>{0}见“复核”中的列表。</translation>
    </message>
    <message>
        <source>form of ball, cone</source>
        <translation>球与锥孔形状</translation>
    </message>
    <message>
        <source>seating</source>
        <translation>就位</translation>
    </message>
    <message>
        <source>disc diameter</source>
        <translation>发光面直径</translation>
    </message>
    <message>
        <source>two-stage method</source>
        <translation>两步法</translation>
    </message>
    <message>
        <source>lens</source>
        <translation>镜头</translation>
    </message>
    <message>
        <source>Choose your camera.</source>
        <translation>请选择您的相机。</translation>
    </message>
    <message>
        <source>No image received from the camera yet.</source>
        <translation>尚未收到相机图像。</translation>
    </message>
    <message>
        <source>The intrinsics file is for another image size. Open the file of this camera.</source>
        <translation>内参文件适用于其他图像尺寸。请打开此相机的文件。</translation>
    </message>
    <message>
        <source>The second camera is not open. Open it.</source>
        <translation>第二台相机尚未打开。请打开。</translation>
    </message>
    <message>
        <source>The rig file does not describe two cameras. Open another file.</source>
        <translation>该相机组文件不是两台相机的文件。请打开其他文件。</translation>
    </message>
    <message>
        <source>The rig file is for another image size of the second camera. Open the file of these cameras.</source>
        <translation>相机组文件中第二台相机的图像尺寸与实际不同。请打开这些相机的文件。</translation>
    </message>
    <message>
        <source>Open the LED geometry file.</source>
        <translation>请打开 LED 几何文件。</translation>
    </message>
    <message>
        <source>WAITING</source>
        <translation>等待</translation>
    </message>
    <message>
        <source>PEN SEEN</source>
        <translation>看到光笔</translation>
    </message>
    <message>
        <source>SEATED</source>
        <translation>已就位</translation>
    </message>
    <message>
        <source>READY</source>
        <translation>就绪</translation>
    </message>
    <message>
        <source>CAPTURING</source>
        <translation>采集中</translation>
    </message>
    <message>
        <source>PAUSED</source>
        <translation>已暂停</translation>
    </message>
    <message>
        <source>COMPUTING</source>
        <translation>计算中</translation>
    </message>
    <message>
        <source>NO TIP</source>
        <translation>无结果</translation>
    </message>
    <message>
        <source>PEN LOST</source>
        <translation>光笔丢失</translation>
    </message>
    <message>
        <source>LIFTED</source>
        <translation>已抬起</translation>
    </message>
    <message>
        <source>TIP MOVED</source>
        <translation>测头移位</translation>
    </message>
    <message>
        <source>LIVE CAMERA</source>
        <translation>实时相机</translation>
    </message>
    <message>
        <source>RECORDED</source>
        <translation>录制图像</translation>
    </message>
    <message>
        <source>SIMULATED</source>
        <translation>模拟</translation>
    </message>
    <message>
        <source>ORIGIN NOT STATED</source>
        <translation>来源未注明</translation>
    </message>
    <message>
        <source>PASS</source>
        <translation>合格</translation>
    </message>
    <message>
        <source>SCALE OK</source>
        <translation>比例合格</translation>
    </message>
    <message>
        <source>STEADY</source>
        <translation>稳定</translation>
    </message>
    <message>
        <source>CHECK</source>
        <translation>需检查</translation>
    </message>
    <message>
        <source>REPEAT</source>
        <translation>重新摆动</translation>
    </message>
    <message>
        <source>Slight tilt. Keep the tip pressed in.</source>
        <translation>小幅倾斜。保持测头压紧。</translation>
    </message>
    <message>
        <source>Large tilt. Keep the tip pressed in.</source>
        <translation>大幅倾斜。保持测头压紧。</translation>
    </message>
    <message>
        <source>away and right</source>
        <translation>右前方</translation>
    </message>
    <message>
        <source>away and left</source>
        <translation>左前方</translation>
    </message>
    <message>
        <source>towards you and left</source>
        <translation>左后方</translation>
    </message>
    <message>
        <source>towards you and right</source>
        <translation>右后方</translation>
    </message>
    <message>
        <source>Image noise</source>
        <translation>图像噪声</translation>
    </message>
    <message>
        <source>Form error of ball and cone</source>
        <translation>测球和锥孔的形状误差</translation>
    </message>
    <message>
        <source>Seating of the tip in the cone</source>
        <translation>测头在锥孔中的就位</translation>
    </message>
    <message>
        <source>Drift of cone and camera</source>
        <translation>锥孔与相机的漂移</translation>
    </message>
    <message>
        <source>LED positions of the LED file</source>
        <translation>LED 文件中的 LED 位置</translation>
    </message>
    <message>
        <source>Diameter of the LED discs</source>
        <translation>LED 发光面直径</translation>
    </message>
    <message>
        <source>Intrinsics of the camera</source>
        <translation>相机内参</translation>
    </message>
    <message>
        <source>Extrinsics of the cameras</source>
        <translation>相机的外参</translation>
    </message>
    <message>
        <source>Two-stage method, difference from the joint fit</source>
        <translation>两步法，与联合拟合之差</translation>
    </message>
    <message>
        <source>Lens and LED centres</source>
        <translation>镜头与 LED 中心</translation>
    </message>
    <message>
        <source>Today</source>
        <translation>今天</translation>
    </message>
    <message>
        <source>Yesterday</source>
        <translation>昨天</translation>
    </message>
    <message>
        <source>{0} days ago</source>
        <translation>{0} 天前</translation>
    </message>
    <message>
        <source>ACCEPTED</source>
        <translation>已接受</translation>
    </message>
    <message>
        <source>PRACTICE SAVED</source>
        <translation>练习已保存</translation>
    </message>
    <message>
        <source>Simulated result; not used for any pen.</source>
        <translation>模拟结果，不用于任何光笔。</translation>
    </message>
    <message>
        <source>to the right</source>
        <translation>向右</translation>
    </message>
    <message>
        <source>away from you</source>
        <translation>前方</translation>
    </message>
    <message>
        <source>to the left</source>
        <translation>向左</translation>
    </message>
    <message>
        <source>towards you</source>
        <translation>后方</translation>
    </message>
    <message>
        <source>Upright</source>
        <translation>竖直</translation>
    </message>
    <message>
        <source>Turn it counter-clockwise, seen from above.</source>
        <translation>从上方看，逆时针转动。</translation>
    </message>
    <message>
        <source>Turn it clockwise, seen from above.</source>
        <translation>从上方看，顺时针转动。</translation>
    </message>
    <message>
        <source>1 image</source>
        <translation>1 幅图像</translation>
    </message>
    <message>
        <source>{0} images</source>
        <translation>{0} 幅图像</translation>
    </message>
</context>
<context>
    <name>standing</name>
    <message>
        <source>valid</source>
        <translation>未到期</translation>
    </message>
    <message>
        <source>OVERDUE</source>
        <translation>已到期</translation>
    </message>
    <message>
        <source>NOT CALIBRATED</source>
        <translation>未标定</translation>
    </message>
    <message>
        <source>RETIRED</source>
        <translation>已停用</translation>
    </message>
    <message>
        <source>Pen {0}</source>
        <translation>光笔{0}</translation>
    </message>
    <message>
        <source>Tip {0}</source>
        <translation>测头{0}</translation>
    </message>
    <message>
        <source>Cone {0}</source>
        <translation>锥孔{0}</translation>
    </message>
</context>
</TS>
