"""The texts of the diagnosis in Chinese, with the keys of `english_diagnosis.py`."""

CHINESE_DIAGNOSIS: dict[str, str] = {
    "diagnosis": "诊断：几何模型无法解释的部分",
    "error_by_geometry": "仅用几何模型的位置误差",
    "error_with_causes": "考虑下列原因后",
    "rows_that_chose_nothing": "未参与选择的行的均方根",
    "less_with_interval": "减小 {percent} %（95 %：{low} 至 {high} %）",
    "more_with_interval": "增大 {percent} %（95 %：{low} 至 {high} %）",
    "noise_alone": "仅由噪声留下的误差",
    "noise_alone_note": "由仪器声明的噪声得出",
    "causes": "原因",
    "no_cause": "目录中没有任何原因超出噪声。",
    "cause_cost": "造成 {cost} mm 均方根误差。为真实原因的概率：{percent} %。",
    "cause_share": "占几何模型无法解释部分的 {percent} %",
    "cannot_exclude": "数据无法排除：",
    "in_sample_only": "其改善未在留出的行块上得到证实。",
    "at_the_machine": "在设备上：",
    "more_causes": "另有 {count} 个较小的原因见 diagnosis.json。",
    "evidence": "残差：按行，以及随所记录的各个量",
    "evidence_before": "灰色：仅几何模型",
    "evidence_after": "蓝色：考虑原因后",
    "evidence_held": "橙色：考虑原因后，未参与选择的行",
    "remains_open": "尚未解决的问题",
    "remains_depends": "剩余误差取决于 {names}。",
    "remains_nothing": "剩余误差与所记录的任何量无关。",
    "cannot_tell": "这些数据无法区分 {one} 与 {other}。",
    "or_else": "或者：{word}。",
    "measure_follow_up": "测量能区分它们的位姿",
    "follow_up_warning": (
        "机器人将运动到诊断所要求的位姿，最多三轮，直到原因以 95 % 的概率确定。请先到单元旁查看："
        "围栏内无人，无障碍物，靶标已固定，急停按钮触手可及。本页面不是安全装置。"
    ),
    "follow_up_confirm": "我已查看：允许运动并开始",
    "download_next_poses": "next_poses.csv",
    "download_diagnosis": "diagnosis.json",
    "not_to_be_seen": "在这些读数中无法看到：",
    "open_report": "给工厂工程师的报告",
}
